//! The branches of the largest real parts alone, for sweeps of large problems.
//!
//! A branch whose largest real part over the given values is among the n largest is, where it takes that value, among
//! the n largest modes: following the first n modes of every value both ways finds it. Branches are continued by the
//! correlation of their vectors alone. An interval is halved at most [`HALVINGS`] times until that is decisive for the
//! first modes of its ends: a veering sharper than the mesh is crossed along the shape of the mode, where the mesh of all
//! modes would follow it round the bend. What is joined once stays joined, so every mode is continued once per interval.

use std::collections::BTreeSet;

use crate::error::input::Error;
use crate::locus::branches::{Link, Mesh, NOWHERE};
use crate::locus::node::{Member, Node};
use crate::locus::watched_path::WatchedPath;

/// How often the interval between two given values is halved; what is not decided then counts as a meeting. The cost is
/// bounded: a large problem has dense modes that veer or meet everywhere.
const HALVINGS: usize = 1;

/// The mesh through `values` that continues all candidates for the `modes` branches of the largest real parts, and these
/// candidates as members of the first node. Its links lead nowhere for other members.
pub(crate) fn leading(
    path: WatchedPath<'_>,
    values: &[f64],
    modes: usize,
) -> Result<(Mesh, Vec<usize>), Error> {
    let mut mesh = Mesh::joined(path, values, &|[from, to], depth, divisible| {
        let mut link = Link { next: from.apart(), ..Link::default() };
        extend(&mut link, from, to, &foremost(from, modes), &foremost(to, modes));
        (!(divisible && link.meeting && depth < HALVINGS)).then_some(link)
    })?;
    let mut followed: Vec<Vec<bool>> =
        mesh.nodes.iter().map(|node| foremost(node, modes)).collect();
    while spread(path, &mut mesh, &mut followed)? {}
    let members = mesh.nodes[0].members();
    let first = (0..members.len()).filter(|&k| followed[0][members[k].mode]).collect();
    Ok((mesh, first))
}

/// Which are the modes of the largest real parts, so many that they hold twice as many eigenvalues as `modes`: a pair
/// may part into two real ones on the way.
fn foremost(node: &Node, modes: usize) -> Vec<bool> {
    let mut order: Vec<usize> = (0..node.modes.len()).collect();
    let real = |mode: usize| node.modes[mode].eigenvalue.re;
    order.sort_by(|&r, &s| real(s).total_cmp(&real(r)));
    let mut eigenvalues = 0;
    let mut chosen = vec![false; node.modes.len()];
    for mode in order {
        if eigenvalues >= 2 * modes {
            break;
        }
        chosen[mode] = true;
        eigenvalues += if node.modes[mode].is_real() { 1 } else { 2 };
    }
    chosen
}

/// Follows modes on along all links, both ways, and says whether that took any link further.
fn spread(
    path: WatchedPath<'_>,
    mesh: &mut Mesh,
    followed: &mut [Vec<bool>],
) -> Result<bool, Error> {
    let mut any = false;
    let count = mesh.links.len();
    for k in (0..count).chain((0..count).rev()) {
        path.go_on()?;
        let (from, to) = (&mesh.nodes[k], &mesh.nodes[k + 1]);
        any |= extend(&mut mesh.links[k], from, to, &followed[k], &followed[k + 1]);
        let (here, there) = (from.members(), to.members());
        let (before, after) = followed.split_at_mut(k + 1);
        for (member, &j) in here.iter().zip(&mesh.links[k].next).filter(|(_, j)| **j != NOWHERE) {
            let (r, s) = (&mut before[k][member.mode], &mut after[0][there[j].mode]);
            let either = *r || *s;
            (*r, *s) = (either, either);
        }
    }
    Ok(any)
}

/// Joins what is followed at either end and not joined yet, by correlation or else to the nearest, which is a meeting;
/// says whether there was any.
fn extend(link: &mut Link, from: &Node, to: &Node, here: &[bool], there: &[bool]) -> bool {
    let (members, others) = (from.members(), to.members());
    let mut before = vec![NOWHERE; others.len()];
    let mut next = std::mem::take(&mut link.next);
    (0..next.len()).filter(|&i| next[i] != NOWHERE).for_each(|i| before[next[i]] = i);
    let open = |members: &[Member], joined: &[usize], followed: &[bool]| -> Vec<usize> {
        let open = members.iter().zip(joined);
        let open = open.filter(|(member, to)| followed[member.mode] && **to == NOWHERE);
        open.map(|(member, _)| member.mode).collect::<BTreeSet<_>>().into_iter().collect()
    };
    // Of each mode its first member: those of a pair are neighbours.
    let first = |members: &[Member], mode: usize| members.iter().position(|m| m.mode == mode);
    let join = |r: usize, s: usize, next: &mut [usize], before: &mut [usize]| {
        let (Some(i), Some(j)) = (first(&members, r), first(&others, s)) else { return };
        for k in 0..if from.modes[r].is_real() { 1 } else { 2 } {
            if next[i + k] == NOWHERE && before[j + k] == NOWHERE {
                (next[i + k], before[j + k]) = (j + k, i + k);
            }
        }
    };
    let rows = open(&members, &next, here);
    for (&r, s) in rows.iter().zip(from.decided_modes(&rows, to).0) {
        if let Some(s) = s {
            join(r, s, &mut next, &mut before);
        }
    }
    let columns = open(&others, &before, there);
    for (&s, r) in columns.iter().zip(to.decided_modes(&columns, from).0) {
        if let Some(r) = r {
            join(r, s, &mut next, &mut before);
        }
    }
    if !open(&members, &next, here).is_empty() || !open(&others, &before, there).is_empty() {
        link.meeting = true;
        next = from.nearest(to, next, |i, j| here[members[i].mode] || there[others[j].mode]);
    }
    link.next = next;
    !rows.is_empty() || !columns.is_empty()
}
