//! Connected components of a graph.

/// Index sets that no edge connects, each ascending, by their first members. `neighbours` adds those of one index to a
/// list; edges lead both ways.
pub(crate) fn components(
    size: usize,
    neighbours: impl Fn(usize, &mut Vec<usize>),
) -> Vec<Vec<usize>> {
    let mut seen = vec![false; size];
    let mut found = Vec::new();
    let mut open = Vec::new();
    for seed in 0..size {
        if seen[seed] {
            continue;
        }
        let mut members = Vec::new();
        open.push(seed);
        while let Some(index) = open.pop() {
            if !std::mem::replace(&mut seen[index], true) {
                members.push(index);
                neighbours(index, &mut open);
            }
        }
        members.sort_unstable();
        found.push(members);
    }
    found
}
