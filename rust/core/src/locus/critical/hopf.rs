//! Hopf points alone: only the modes that may reach the imaginary axis are followed.
//!
//! Most modes of a fine mesh stay far below the axis. Over an interval of width w the real part of a mode can reach it
//! by its slope, or by meeting another mode: `(lambda_r - lambda_s)^2` goes linearly through an exceptional point, so the
//! distance of two modes that would meet after the part t of w grows by no more than `sqrt(1 + 1 / t)`, and half of it is
//! the distance of each from their mean. Modes that neither effect takes to the axis, with a margin of two, are not followed.
//! The others are continued from both ends of the interval, those that meet or nearly do in pairs; the interval is halved
//! until the continuation is as safe as on the mesh of all modes.

use crate::error::input::Error;
use crate::locus::branches::{self, Link, Mesh, NOWHERE, Pair};
use crate::locus::critical::pair::{self, Continuation};
use crate::locus::critical::point::{CriticalPoint, RESOLUTION};
use crate::locus::critical::roots::{axis_crossings, initial_values, real_part};
use crate::locus::node::Node;
use crate::locus::watched_path::WatchedPath;

/// Number of equal intervals that the search starts from. Each interval is divided further as its modes within reach need,
/// so half as many as for the mesh of all modes suffice.
const INTERVALS: usize = 32;
/// How much further than predicted from one end of an interval a mode is allowed to come.
const MARGIN: f64 = 2.0;

/// Hopf points in ascending order, and at how many parameter values the eigenproblem was solved for the mesh.
#[derive(Debug)]
pub struct HopfSearch {
    /// Hopf points, ascending in the parameter.
    pub points: Vec<CriticalPoint>,
    /// Number of parameter values of the mesh.
    pub nodes: usize,
    /// Modes continued from one node to the next, all intervals together.
    pub followed: usize,
}

/// All Hopf points of a path, as `critical_points` finds them among all others.
pub fn hopf_points(path: WatchedPath<'_>) -> Result<HopfSearch, Error> {
    let mesh = hopf_mesh(path)?;
    let points = axis_crossings(path, &mesh, 0..mesh.links.len())?;
    let followed = (0..mesh.links.len()).map(|k| mesh.continued(k).len()).sum();
    Ok(HopfSearch { points, nodes: mesh.nodes.len(), followed })
}

/// The mesh on which the modes that may reach the imaginary axis are followed.
pub(super) fn hopf_mesh(path: WatchedPath<'_>) -> Result<Mesh, Error> {
    let values = initial_values(&path, INTERVALS);
    Mesh::joined(path, &values, &|ends, _, divisible| joined(path, ends, divisible))
}

/// The first Hopf point from the lower end on that is `wanted`; beyond, nothing is computed.
pub fn first_hopf_point(
    path: WatchedPath<'_>,
    mut wanted: impl FnMut(&CriticalPoint) -> bool,
) -> Result<Option<CriticalPoint>, Error> {
    let upper = path.range().1;
    let mut mesh = Mesh::default();
    let mut examined = 0;
    for value in initial_values(&path, INTERVALS) {
        let node = Node::new(path, value)?;
        let part = match mesh.nodes.last() {
            Some(last) => Mesh::between(path, [last, &node], &|ends, _, divisible| {
                joined(path, ends, divisible)
            })?,
            None => Mesh::default(),
        };
        mesh.append(part, node);
        // Of a mode on the axis at the last node the next interval tells whether it crosses.
        let mut ready = mesh.links.len();
        while value < upper && ready > examined && ends_on_axis(&mesh, ready - 1) {
            ready -= 1;
        }
        let points = axis_crossings(path, &mesh, examined..ready)?;
        examined = ready;
        if let Some(first) = points.into_iter().find(&mut wanted) {
            return Ok(Some(first));
        }
    }
    Ok(None)
}

/// Whether a mode that is continued along an interval lies on the axis at its end.
fn ends_on_axis(mesh: &Mesh, interval: usize) -> bool {
    let end = &mesh.nodes[interval + 1];
    mesh.continued(interval).iter().any(|&(_, mode)| end.growth_sign(mode) == 0.0)
}

/// Modes of a node that may reach the axis within `width` of it.
fn within_reach(node: &Node, width: f64) -> Vec<usize> {
    let modes = &node.modes;
    let mut reaches: Vec<bool> = (0..modes.len())
        .map(|r| {
            let rise = node.slopes[r].re * width;
            // Also so for a slope that is not finite, as of a defective mode.
            !(modes[r].eigenvalue.re.abs() > MARGIN * rise.abs() + node.uncertainty(r))
        })
        .collect();
    let meets = |r: usize, s: usize, conjugate: bool| {
        let (distance, part) = node.approach(r, (s, conjugate), width);
        let mean = 0.5 * (modes[r].eigenvalue.re + modes[s].eigenvalue.re);
        let rise = 0.5 * (node.slopes[r].re + node.slopes[s].re) * width;
        let excursion = 0.5 * distance * (1.0 + 1.0 / part).sqrt();
        !(part > MARGIN || mean.abs() > MARGIN * (excursion + rise.abs()))
    };
    for r in 0..modes.len() {
        if !modes[r].is_real() && meets(r, r, true) {
            reaches[r] = true;
        }
        for s in 0..r {
            if meets(r, s, false) {
                (reaches[r], reaches[s]) = (true, true);
            }
        }
    }
    (0..modes.len()).filter(|&r| reaches[r]).collect()
}

/// The link of the modes within reach of the axis at either end; None if the interval has to be divided first.
fn joined(path: WatchedPath<'_>, [from, to]: [&Node; 2], divisible: bool) -> Option<Link> {
    let (lower, upper) = path.range();
    let (span, width) = (upper - lower, to.value - from.value);
    let is_settled = |pair: &Pair| pair::is_settled([from, to], pair);
    let next = continued(from, to);
    let settled = next.as_ref().is_some_and(|(next, pairs)| {
        let mut continued = next.iter().enumerate().filter(|(_, s)| **s != NOWHERE);
        (width <= RESOLUTION * span
            || continued.all(|(r, &s)| real_part(from, to, r, s).is_settled()))
            && pairs.iter().all(is_settled)
    });
    if !settled && divisible && width > branches::RESOLUTION * span {
        return None;
    }
    // Where branches meet the axis is not crossed but left.
    Some(match next {
        Some((next, mut pairs)) => {
            pairs.retain(is_settled);
            Link { next: from.members_of(to, &next), meeting: false, pairs }
        }
        None => Link { next: from.apart(), meeting: true, pairs: Vec::new() },
    })
}

/// The continuation of all modes within reach at either end, and those of them that go on in pairs, if it is safe.
fn continued(from: &Node, to: &Node) -> Option<(Vec<usize>, Vec<Pair>)> {
    let width = to.value - from.value;
    let mut next = vec![NOWHERE; from.modes.len()];
    let forward = Continuation::new(from, &within_reach(from, width), to)?;
    forward.singles.iter().for_each(|&(r, s)| next[r] = s);
    let (mut others, taken) = (within_reach(to, width), forward.taken_together(1));
    others.retain(|s| !next.contains(s) && !taken.contains(s));
    let back = Continuation::new(to, &others, from)?;
    back.singles.iter().for_each(|&(s, r)| next[r] = s);
    let back = back.pairs.into_iter().map(|[there, here]| [here, there]);
    let pairs = forward.pairs.into_iter().chain(back).collect();
    Some((next, pairs))
}
