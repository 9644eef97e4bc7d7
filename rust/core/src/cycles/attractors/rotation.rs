//! The section at which an orbit begins: the same one wherever in its period the orbit was found.

use std::cmp::Ordering::Equal;
use std::cmp::Reverse;

use crate::cycles::orbits::orbit::Orbit;

/// The same orbit from the section at which its combinations come first in the alphabet; among equals from the longest
/// phases on.
pub(super) fn rotated(mut orbit: Orbit) -> Orbit {
    let names: Vec<String> = orbit.steps.iter().map(|step| step.combination.to_string()).collect();
    let durations: Vec<_> = orbit.steps.iter().map(|step| Reverse(step.duration)).collect();
    let ranks = [rotation_ranks(&names), rotation_ranks(&durations)];
    let lasting = (0..orbit.steps.len()).filter(|&k| orbit.lasts(k));
    let first = lasting.min_by_key(|&k| [ranks[0][k], ranks[1][k]]).unwrap_or_default();
    orbit.steps.rotate_left(first);
    orbit
}

/// The place of the sequence that begins at each entry and runs round, among all of them in the order of a dictionary;
/// equal sequences have the same. By doubling the length compared (Karp, Miller, and Rosenberg 1972), O(n log^2 n).
fn rotation_ranks<T: PartialOrd>(sequence: &[T]) -> Vec<usize> {
    let count = sequence.len();
    let mut ranks = dense_ranks(sequence);
    let mut compared = 1;
    while compared < count {
        let pairs: Vec<_> = (0..count).map(|k| (ranks[k], ranks[(k + compared) % count])).collect();
        ranks = dense_ranks(&pairs);
        compared *= 2;
    }
    ranks
}

/// How many different values are smaller than each.
fn dense_ranks<T: PartialOrd>(values: &[T]) -> Vec<usize> {
    let compare = |&a: &usize, &b: &usize| values[a].partial_cmp(&values[b]).unwrap_or(Equal);
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(compare);
    let mut ranks = vec![0; values.len()];
    for pair in order.windows(2) {
        ranks[pair[1]] = ranks[pair[0]] + usize::from(values[pair[0]] < values[pair[1]]);
    }
    ranks
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Half a million phases of one combination: what compared each section with the best one, entry by entry, took hours.
    #[test]
    fn the_ranks_of_many_equal_rotations_take_no_quadratic_time() {
        let mut sequence = vec![0; 500_000];
        sequence[250_000] = 1;
        let ranks = rotation_ranks(&sequence);
        assert_eq!((ranks[250_001], ranks[250_000]), (0, 499_999));
    }

    proptest! {
        /// Few different entries, so that long sequences are equal.
        #[test]
        fn the_ranks_of_rotations_are_those_of_the_comparison_one_by_one(
            round in prop::collection::vec(0..2usize, 1..12),
            rounds in 1..4usize,
        ) {
            let sequence = round.repeat(rounds);
            let rotated = |first: usize| [&sequence[first..], &sequence[..first]].concat();
            let ranks = rotation_ranks(&sequence);
            for (a, b) in (0..sequence.len()).flat_map(|a| (0..a).map(move |b| (a, b))) {
                prop_assert_eq!(ranks[a].cmp(&ranks[b]), rotated(a).cmp(&rotated(b)));
            }
        }
    }
}
