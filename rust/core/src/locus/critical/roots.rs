//! Roots of real parts between two nodes of a mesh, and the branches that cross the imaginary axis.

use std::ops::Range;

use rayon::prelude::*;

use crate::error::input::Error;
use crate::linalg::parallel::in_parallel;
use crate::locus::branches::{Mesh, Pair};
use crate::locus::critical::pair::product_of_growths;
use crate::locus::critical::point::{CriticalKind, CriticalPoint, RESOLUTION, Stretch};
use crate::locus::node::Node;
use crate::locus::parameter_path::Path;
use crate::locus::watched_path::WatchedPath;
use crate::numerics::bracket::Bracket;

/// Ends of so many equal intervals of the whole range.
pub(crate) fn initial_values(path: &Path, intervals: usize) -> Vec<f64> {
    let (lower, upper) = path.range();
    let value = |k: usize| lower + (upper - lower) * (k as f64 / intervals as f64);
    (0..intervals).map(value).chain([upper]).collect()
}

pub(crate) fn real_part(a: &Node, b: &Node, mode: usize, next: usize) -> Stretch {
    let width = b.value - a.value;
    Stretch {
        value: [a.modes[mode].eigenvalue.re, b.modes[next].eigenvalue.re],
        rise: [a.slopes[mode].re * width, b.slopes[next].re * width],
        uncertainty: [a.uncertainty(mode), b.uncertainty(next)],
    }
}

/// The modes of a node that continue some modes of `from`.
pub(crate) fn followed(from: &Node, modes: &[usize], node: &Node) -> Vec<usize> {
    let nearest = |mode: usize| {
        let way = node.value - from.value;
        let predicted = from.modes[mode].eigenvalue + from.slopes[mode] * way;
        let distance = |k: usize| (node.modes[k].eigenvalue - predicted).norm();
        (0..node.modes.len()).fold(0, |best, k| if distance(k) < distance(best) { k } else { best })
    };
    match from.continued_modes(modes, node).0 {
        Some(next) => next,
        None => modes.iter().map(|&mode| nearest(mode)).collect(),
    }
}

/// The root of `f(node, modes) = (value, slope)` between two nodes, for the modes of a node that `follow` from the first, by
/// Newton's method kept inside its bracket; `sign` is that of f at the first.
pub(crate) fn root<Modes>(
    path: WatchedPath<'_>,
    [from, to]: [&Node; 2],
    follow: impl Fn(&Node) -> Modes,
    sign: f64,
    f: impl Fn(&Node, &Modes) -> (f64, f64),
) -> Result<(Node, Modes), Error> {
    let (lower, upper) = path.range();
    let mut bracket = Bracket { low: from.value, high: to.value };
    let mut p = bracket.middle();
    loop {
        let node = Node::new(path, p)?;
        let next = follow(&node);
        let (value, slope) = f(&node, &next);
        let step = -value / slope;
        let resolution = 2.0 * f64::EPSILON * p.abs().max(f64::EPSILON * (upper - lower));
        let proposed = bracket.narrowed(p, value * sign > 0.0, p + step);
        let found =
            value == 0.0 || step.abs() <= resolution || bracket.high - bracket.low <= resolution;
        match proposed {
            Some(proposed) if !found => p = proposed,
            _ => return Ok((node, next)),
        }
    }
}

/// Where a mode of the first node passes the axis before the second, at which its sign is another one; None where it
/// is real: those pass zero where the stiffness is singular.
fn axis_crossing(
    path: WatchedPath<'_>,
    ends: [&Node; 2],
    mode: usize,
    sign: f64,
) -> Result<Option<CriticalPoint>, Error> {
    let follow = |node: &Node| followed(ends[0], &[mode], node);
    let (root, next) = root(path, ends, follow, sign, |node, next| {
        (node.modes[next[0]].eigenvalue.re, node.slopes[next[0]].re)
    })?;
    let eigenvalue = root.modes[next[0]].eigenvalue;
    let slope = root.slopes[next[0]].re;
    Ok((eigenvalue.im != 0.0)
        .then(|| CriticalPoint::at(CriticalKind::Hopf, root.value, eigenvalue, slope)))
}

/// Where one of two modes that go on together passes the axis between two nodes; None where neither does.
fn pair_crossing(
    path: WatchedPath<'_>,
    ends: [&Node; 2],
    pair: &Pair,
) -> Result<Option<CriticalPoint>, Error> {
    let [before, after] = [0, 1].map(|side| product_of_growths(ends[side], pair[side]).0);
    if before * after > 0.0 {
        return Ok(None);
    }
    let follow = |node: &Node| ends[0].continued_by_two(&pair[0], node).0;
    let (root, next) =
        root(path, ends, follow, before.signum(), |node, next| product_of_growths(node, *next))?;
    let growth = |mode: usize| root.modes[mode].eigenvalue.re.abs();
    let mode = if growth(next[0]) < growth(next[1]) { next[0] } else { next[1] };
    let (eigenvalue, slope) = (root.modes[mode].eigenvalue, root.slopes[mode].re);
    Ok(Some(CriticalPoint::at(CriticalKind::Hopf, root.value, eigenvalue, slope)))
}

/// Whether nodes at which a function has no sign are as one: nearer to each other than the roots that a search tells apart.
/// A function that has one sign before them and the other after has a root there, as it is continuous; where it has no
/// sign over a longer stretch, it does not cross zero but lies on it and leaves it.
pub(crate) fn is_brief(path: WatchedPath<'_>, nodes: &[Node]) -> bool {
    let (lower, upper) = path.range();
    match nodes {
        [first, .., last] => last.value - first.value <= RESOLUTION * (upper - lower),
        _ => true,
    }
}

/// Where complex branches change the sign of their real parts, from the starts of some intervals on.
pub(crate) fn axis_crossings(
    path: WatchedPath<'_>,
    mesh: &Mesh,
    starts: Range<usize>,
) -> Result<Vec<CriticalPoint>, Error> {
    let mut crossings = Vec::new();
    let mut pairs = Vec::new();
    for start in starts {
        let ends = [&mesh.nodes[start], &mesh.nodes[start + 1]];
        pairs.extend(mesh.links[start].pairs.iter().map(|pair| (ends, pair)));
        for (mode, next) in mesh.continued(start) {
            let before = mesh.nodes[start].growth_sign(mode);
            let (mut end, mut reached) = (start + 1, next);
            while mesh.nodes[end].growth_sign(reached) == 0.0
                && before != 0.0
                && end < mesh.links.len()
                && let Some(&(_, beyond)) = mesh.continued(end).iter().find(|one| one.0 == reached)
            {
                (end, reached) = (end + 1, beyond);
            }
            let crosses = before * mesh.nodes[end].growth_sign(reached) < 0.0;
            if crosses && is_brief(path, &mesh.nodes[start + 1..end]) {
                crossings.push(([&mesh.nodes[start], &mesh.nodes[end]], mode, before));
            }
        }
    }
    let point = |(ends, mode, sign)| axis_crossing(path, ends, mode, sign);
    let of_pair = |(ends, pair)| pair_crossing(path, ends, pair);
    let points: Vec<Option<CriticalPoint>> = in_parallel(|| {
        let points = crossings.into_par_iter().map(point);
        points.chain(pairs.into_par_iter().map(of_pair)).collect::<Result<_, _>>()
    })?;
    let mut points: Vec<CriticalPoint> = points.into_iter().flatten().collect();
    points.sort_by(|p, q| p.value.total_cmp(&q.value));
    Ok(points)
}
