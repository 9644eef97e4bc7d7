//! Roots of real parts between two nodes of a mesh, and the branches that cross the imaginary axis.

use std::ops::Range;

use rayon::prelude::*;

use crate::error::input::Error;
use crate::linalg::parallel::in_parallel;
use crate::locus::branches::Mesh;
use crate::locus::critical::point::{
    CriticalKind, CriticalPoint, RESOLUTION, Stretch, significant_sign,
};
use crate::locus::node::Node;
use crate::locus::parameter_path::Path;
use crate::locus::watched_path::WatchedPath;
use crate::numerics::bracket::Bracket;

/// Ulp, times condition times modulus, below which a real part has no sign. Verdicts ask [`Mode::rounding`] instead, which
/// takes products of all matrices for every mode; a search brackets roots, and a sign left open here only moves the end
/// of a bracket to the next node.
///
/// [`Mode::rounding`]: crate::modes::mode::Mode::rounding
const NEUTRAL: f64 = 64.0 * f64::EPSILON;

/// Ends of so many equal intervals of the whole range.
pub(crate) fn initial_values(path: &Path, intervals: usize) -> Vec<f64> {
    let (lower, upper) = path.range();
    let value = |k: usize| lower + (upper - lower) * (k as f64 / intervals as f64);
    (0..intervals).map(value).chain([upper]).collect()
}

pub(crate) fn uncertainty(node: &Node, mode: usize) -> f64 {
    NEUTRAL * node.modes[mode].condition * node.modes[mode].eigenvalue.norm()
}

pub(crate) fn real_part(a: &Node, b: &Node, mode: usize, next: usize) -> Stretch {
    let width = b.value - a.value;
    Stretch {
        value: [a.modes[mode].eigenvalue.re, b.modes[next].eigenvalue.re],
        rise: [a.slopes[mode].re * width, b.slopes[next].re * width],
        uncertainty: [uncertainty(a, mode), uncertainty(b, next)],
    }
}

/// The node at p with the modes that continue some modes of `from`.
fn followed(
    path: WatchedPath<'_>,
    from: &Node,
    modes: &[usize],
    p: f64,
) -> Result<(Node, Vec<usize>), Error> {
    let node = Node::new(path, p)?;
    let nearest = |mode: usize| {
        let predicted = from.modes[mode].eigenvalue + from.slopes[mode] * (p - from.value);
        let distance = |k: usize| (node.modes[k].eigenvalue - predicted).norm();
        (0..node.modes.len()).fold(0, |best, k| if distance(k) < distance(best) { k } else { best })
    };
    let next = match from.continued_modes(modes, &node).0 {
        Some(next) => next,
        None => modes.iter().map(|&mode| nearest(mode)).collect(),
    };
    Ok((node, next))
}

/// The root of `f(node, modes continued) = (value, slope)` between two nodes for some modes of `from`, by Newton's
/// method kept inside its bracket; `sign` is that of f at `from`.
pub(crate) fn root(
    path: WatchedPath<'_>,
    [from, to]: [&Node; 2],
    modes: &[usize],
    sign: f64,
    f: impl Fn(&Node, &[usize]) -> (f64, f64),
) -> Result<(Node, Vec<usize>), Error> {
    let (lower, upper) = path.range();
    let mut bracket = Bracket { low: from.value, high: to.value };
    let mut p = bracket.middle();
    loop {
        let (node, next) = followed(path, from, modes, p)?;
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
    let (root, next) = root(path, ends, &[mode], sign, |node, next| {
        (node.modes[next[0]].eigenvalue.re, node.slopes[next[0]].re)
    })?;
    let eigenvalue = root.modes[next[0]].eigenvalue;
    let slope = root.slopes[next[0]].re;
    Ok((eigenvalue.im != 0.0)
        .then(|| CriticalPoint::at(CriticalKind::Hopf, root.value, eigenvalue, slope)))
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

/// The sign of the real part of a mode, 0 within its uncertainty.
pub(crate) fn growth_sign(node: &Node, mode: usize) -> f64 {
    significant_sign(node.modes[mode].eigenvalue.re, uncertainty(node, mode))
}

/// Where complex branches change the sign of their real parts, from the starts of some intervals on.
pub(crate) fn axis_crossings(
    path: WatchedPath<'_>,
    mesh: &Mesh,
    starts: Range<usize>,
) -> Result<Vec<CriticalPoint>, Error> {
    let mut crossings = Vec::new();
    for start in starts {
        for (mode, next) in mesh.continued(start) {
            let before = growth_sign(&mesh.nodes[start], mode);
            let (mut end, mut reached) = (start + 1, next);
            while growth_sign(&mesh.nodes[end], reached) == 0.0
                && before != 0.0
                && end < mesh.links.len()
                && let Some(&(_, beyond)) = mesh.continued(end).iter().find(|one| one.0 == reached)
            {
                (end, reached) = (end + 1, beyond);
            }
            let crosses = before * growth_sign(&mesh.nodes[end], reached) < 0.0;
            if crosses && is_brief(path, &mesh.nodes[start + 1..end]) {
                crossings.push(([&mesh.nodes[start], &mesh.nodes[end]], mode, before));
            }
        }
    }
    let point = |(ends, mode, sign)| axis_crossing(path, ends, mode, sign);
    let points: Vec<Option<CriticalPoint>> =
        in_parallel(|| crossings.into_par_iter().map(point).collect::<Result<_, _>>())?;
    let mut points: Vec<CriticalPoint> = points.into_iter().flatten().collect();
    points.sort_by(|p, q| p.value.total_cmp(&q.value));
    Ok(points)
}
