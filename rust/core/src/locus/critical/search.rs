//! Where stability changes along a path, and where branches meet.
//!
//! Roots of functions of the tracked branches (a real part, a difference of two real parts), each bracketed by two
//! nodes of a mesh so fine that the cubics through values and slopes at its nodes leave no room for further roots,
//! and refined by Newton's method with the slopes `d lambda / d p = -v' (dP/dp) xi / a`.

use num_complex::Complex64;

use crate::error::input::Error;
use crate::linalg::dense::determinant_sign;
use crate::locus::branches::Mesh;
use crate::locus::critical::exceptional_point::ImplicitDeterminant;
use crate::locus::critical::hopf::hopf_mesh;
use crate::locus::critical::lock_ins::lock_ins;
use crate::locus::critical::point::{CriticalKind, CriticalPoint, RESOLUTION, Stretch};
use crate::locus::critical::roots::{
    axis_crossings, followed, initial_values, is_brief, real_part, root,
};
use crate::locus::critical::separation::separations;
use crate::locus::node::Node;
use crate::locus::watched_path::WatchedPath;
use crate::numerics::bracket::Bracket;

/// Equal intervals that a search starts from; the mesh refines itself from there.
const INTERVALS: usize = 64;
/// Critical points, ascending in the parameter, and how much work their search took.
#[derive(Debug)]
pub struct CriticalSearch {
    /// Critical points of every kind.
    pub points: Vec<CriticalPoint>,
    /// Number of parameter values of the mesh.
    pub nodes: usize,
    /// How often Newton's method was started for an exceptional point.
    pub starts: usize,
}

/// All critical points of a path with exceptional points up to `imaginary` off the real axis, by value.
pub fn critical_points(path: WatchedPath<'_>, imaginary: f64) -> Result<CriticalSearch, Error> {
    let (lower, upper) = path.range();
    let span = upper - lower;
    let values = initial_values(&path, INTERVALS);
    let demand = |a: &Node, b: &Node, next: &[usize]| {
        b.value - a.value <= RESOLUTION * span || real_parts_settled(a, b, &successors(a, b, next))
    };
    let mesh = Mesh::new(path, &values, &demand)?;
    let search = CriticalMesh { path, mesh, span };
    let mut points = search.divergences();
    let every = 0..search.mesh.links.len();
    points.extend(axis_crossings(path, &search.mesh, every)?);
    let (lock_ins, starts) = lock_ins(path, &search.mesh, imaginary, &points)?;
    points.extend(search.leader_crossings(&lock_ins)?);
    points.extend(lock_ins);
    points.extend(separations(&path, &values));
    points.sort_by(|p, q| p.value.total_cmp(&q.value).then(p.kind.cmp(&q.kind)));
    Ok(CriticalSearch { points, nodes: search.mesh.nodes.len(), starts })
}

/// The points alone at which stability, or steady sliding, begins or ends: Hopf points, divergences, separations.
pub fn stability_limits(path: WatchedPath<'_>) -> Result<Vec<CriticalPoint>, Error> {
    let (lower, upper) = path.range();
    let search = CriticalMesh { path, mesh: hopf_mesh(path)?, span: upper - lower };
    let mut points = search.divergences();
    points.extend(axis_crossings(path, &search.mesh, 0..search.mesh.links.len())?);
    points.extend(separations(&path, &initial_values(&path, INTERVALS)));
    points.sort_by(|p, q| p.value.total_cmp(&q.value).then(p.kind.cmp(&q.kind)));
    Ok(points)
}

/// For every mode of `a` the mode of `b` that continues it, from the continuation of members.
fn successors(a: &Node, b: &Node, next: &[usize]) -> Vec<usize> {
    let there = b.members();
    a.members()
        .iter()
        .zip(next)
        .filter(|(member, _)| !member.conjugate)
        .map(|(_, &k)| there[k].mode)
        .collect()
}

/// Index of the mode with the largest real part.
fn leader(node: &Node) -> usize {
    let real = |mode: usize| node.modes[mode].eigenvalue.re;
    (0..node.modes.len()).fold(0, |best, mode| if real(mode) > real(best) { mode } else { best })
}

/// Whether the roots of all real parts, and of their differences to the largest one, are known from the two ends.
fn real_parts_settled(a: &Node, b: &Node, next: &[usize]) -> bool {
    let stretches: Vec<Stretch> =
        (0..a.modes.len()).map(|mode| real_part(a, b, mode, next[mode])).collect();
    let leaders = [leader(a), next.iter().position(|&mode| mode == leader(b)).unwrap_or(0)];
    stretches.iter().all(Stretch::is_settled)
        && leaders.iter().all(|&top| {
            (0..stretches.len())
                .all(|mode| mode == top || stretches[top].minus(&stretches[mode]).is_settled())
        })
}

struct CriticalMesh<'a> {
    path: WatchedPath<'a>,
    mesh: Mesh,
    span: f64,
}

impl CriticalMesh<'_> {
    /// Where det K_s changes its sign: a real eigenvalue passes zero. The sign beyond tells the direction, because
    /// `det P(lambda)` has the sign of its leading matrix for large lambda: an odd number of positive eigenvalues makes it
    /// change.
    fn divergences(&self) -> Vec<CriticalPoint> {
        let sign = |p: f64| {
            let pencil = self.path.pencil(p);
            determinant_sign(pencil.leading()) * determinant_sign(pencil.stiffness.rounded())
        };
        let mut points = Vec::new();
        let mut last: Option<(usize, f64)> = None;
        for (k, node) in self.mesh.nodes.iter().enumerate() {
            let here = sign(node.value);
            if here == 0.0 {
                continue;
            }
            if let Some((start, before)) = last
                && before != here
            {
                let from = &self.mesh.nodes[start];
                let value = self.singular_stiffness(from, node, before, &sign);
                let zero = Complex64::default();
                points.push(CriticalPoint::at(CriticalKind::Divergence, value, zero, before));
            }
            last = Some((k, here));
        }
        points
    }

    /// The root of det K_s between two nodes, by Newton's method for its implicit determinant.
    fn singular_stiffness(
        &self,
        from: &Node,
        to: &Node,
        sign: f64,
        sign_at: &dyn Fn(f64) -> f64,
    ) -> f64 {
        let slowest =
            from.modes.iter().min_by(|a, b| a.eigenvalue.norm().total_cmp(&b.eigenvalue.norm()));
        let mut bracket = Bracket { low: from.value, high: to.value };
        let mut p = bracket.middle();
        while bracket.high - bracket.low
            > 2.0 * f64::EPSILON * p.abs().max(f64::EPSILON * self.span)
        {
            let here = sign_at(p);
            let newton = slowest.map_or(f64::NAN, |mode| {
                let expansion = self.path.expansion(Complex64::from(p));
                let d = ImplicitDeterminant::new(
                    &expansion,
                    Complex64::default(),
                    &mode.right,
                    &mode.left,
                );
                p - (d.g / d.by_parameter).re
            });
            match bracket.narrowed(p, here == sign, newton) {
                Some(next) if here != 0.0 => p = next,
                _ => break,
            }
        }
        p
    }

    /// Where the largest real part passes to another branch; at a lock-in it does so trivially.
    fn leader_crossings(&self, lock_ins: &[CriticalPoint]) -> Result<Vec<CriticalPoint>, Error> {
        let carriers = self.mesh.carriers();
        let nodes = &self.mesh.nodes;
        let mut points = Vec::new();
        // The last node with an undisputed leader, and the branch that leads there.
        let mut last: Option<(usize, usize)> = None;
        for (k, node) in nodes.iter().enumerate() {
            let top = leader(node);
            let undisputed = (0..node.modes.len()).filter(|&mode| mode != top).all(|mode| {
                let lead = node.modes[top].eigenvalue.re - node.modes[mode].eigenvalue.re;
                lead > node.uncertainty(top) + node.uncertainty(mode)
            });
            let members = node.members();
            let branch = carriers[k]
                .iter()
                .position(|&carrier| members[carrier].mode == top && !members[carrier].conjugate);
            let (true, Some(branch)) = (undisputed, branch) else { continue };
            if let Some((start, before)) = last
                && before != branch
                && is_brief(self.path, &nodes[start + 1..k])
                && self.mesh.links[start..k].iter().all(|link| !link.meeting)
            {
                let there = nodes[start].members();
                let mode = |branch: usize| there[carriers[start][branch]].mode;
                let ends = [&nodes[start], node];
                self.leader_crossings_between(ends, mode(before), mode(branch), &mut points)?;
            }
            last = Some((k, branch));
        }
        points.retain(|point| {
            lock_ins.iter().all(|other| {
                other.complex_value.im != 0.0
                    || (other.value - point.value).abs() > 1e-6 * self.span
            })
        });
        Ok(points)
    }

    /// `old` leads at the first node, `new` at the second; both are modes of the first.
    fn leader_crossings_between(
        &self,
        [from, to]: [&Node; 2],
        old: usize,
        new: usize,
        points: &mut Vec<CriticalPoint>,
    ) -> Result<(), Error> {
        let modes: Vec<usize> = (0..from.modes.len()).collect();
        let follow = |node: &Node| followed(from, &modes, node);
        let (root, next) = root(self.path, [from, to], follow, 1.0, |node, next| {
            let part = |mode: usize| node.modes[next[mode]].eigenvalue.re;
            let slope = |mode: usize| node.slopes[next[mode]].re;
            (part(old) - part(new), slope(old) - slope(new))
        })?;
        let top = leader(&root);
        let lead = root.modes[top].eigenvalue.re - root.modes[next[new]].eigenvalue.re;
        let third = next.iter().position(|&mode| mode == top);
        if let Some(third) = third
            && ![old, new].contains(&third)
            && lead > root.uncertainty(top) + root.uncertainty(next[new])
            // On an interval of the mesh the real parts of `old` and of `new` cross every other one at most once, so each
            // division adds a mode to those that lead in turn. Whatever rounding does, either part is shorter than the whole.
            && (from.value < root.value && root.value < to.value)
        {
            self.leader_crossings_between([from, &root], old, third, points)?;
            return self.leader_crossings_between([&root, to], top, next[new], points);
        }
        let [gains, loses] = [new, old].map(|mode| root.modes[next[mode]].eigenvalue);
        let slope = root.slopes[next[new]].re - root.slopes[next[old]].re;
        let point = CriticalPoint::at(CriticalKind::Crossing, root.value, gains, slope);
        points.push(CriticalPoint { other: loses, ..point });
        Ok(())
    }
}
