//! Hopf points alone: only the modes that may reach the imaginary axis are followed.
//!
//! Most modes of a fine mesh stay far below the axis. Over an interval of width w the real part of a mode can reach it
//! by its slope, or by meeting another mode: `(lambda_r - lambda_s)^2` goes linearly through an exceptional point, so the
//! distance of two modes that would meet after the part t of w grows by no more than `sqrt(1 + 1 / t)`, and half of it is
//! the distance of each from their mean. Modes that neither effect takes to the axis, with a margin of two, are not followed.
//! The others are continued from both ends of the interval, which is halved until the continuation is as safe as on the
//! mesh of all modes.

use std::ops::Range;

use rayon::prelude::*;

use crate::error::input::Error;
use crate::linalg::parallel::in_parallel;
use crate::locus::branches;
use crate::locus::critical::point::{CriticalPoint, RESOLUTION, significant_sign};
use crate::locus::critical::search::{axis_crossing, initial_values, real_part, uncertainty};
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
    let node = |value| Node::new(path, value);
    let nodes: Vec<Node> = in_parallel(|| {
        initial_values(&path, INTERVALS).into_par_iter().map(node).collect::<Result<_, _>>()
    })?;
    let (lower, upper) = path.range();
    let part = |pair: &[Node]| {
        let mut part = Track::default();
        part.refine(path, &pair[0], &pair[1], upper - lower)?;
        Ok(part)
    };
    let parts: Vec<Track> =
        in_parallel(|| nodes.par_windows(2).map(part).collect::<Result<_, Error>>())?;
    let mut track = Track::default();
    let mut initial = nodes.into_iter();
    track.nodes.extend(initial.next());
    for (part, node) in parts.into_iter().zip(initial) {
        track.append(part, node);
    }
    let crossings = track.crossings(0..track.links.len());
    let point = |(ends, mode, sign)| axis_crossing(path, ends, mode, sign);
    let points: Vec<Option<CriticalPoint>> =
        in_parallel(|| crossings.into_par_iter().map(point).collect::<Result<_, _>>())?;
    let mut points: Vec<CriticalPoint> = points.into_iter().flatten().collect();
    points.sort_by(|p, q| p.value.total_cmp(&q.value));
    let followed = track.links.iter().map(Vec::len).sum();
    Ok(HopfSearch { points, nodes: track.nodes.len(), followed })
}

/// The first Hopf point from the lower end on that is `wanted`; beyond, nothing is computed. On one thread.
pub fn first_hopf_point(
    path: WatchedPath<'_>,
    mut wanted: impl FnMut(&CriticalPoint) -> bool,
) -> Result<Option<CriticalPoint>, Error> {
    let (lower, upper) = path.range();
    let values = initial_values(&path, INTERVALS);
    let mut track = Track { nodes: vec![Node::new(path, values[0])?], links: Vec::new() };
    let mut examined = 0;
    for &value in &values[1..] {
        let node = Node::new(path, value)?;
        let mut part = Track::default();
        part.refine(path, &track.nodes[track.links.len()], &node, upper - lower)?;
        track.append(part, node);
        // Of a mode on the axis at the last node the next interval tells whether it crosses.
        let open = value < upper && track.ends_on_axis();
        let ready = track.links.len() - usize::from(open);
        let mut points = Vec::new();
        for (ends, mode, sign) in track.crossings(examined..ready) {
            points.extend(axis_crossing(path, ends, mode, sign)?);
        }
        examined = ready;
        points.sort_by(|p, q| p.value.total_cmp(&q.value));
        if let Some(first) = points.into_iter().find(&mut wanted) {
            return Ok(Some(first));
        }
    }
    Ok(None)
}

/// Modes of a node that may reach the axis within `width` of it.
fn within_reach(node: &Node, width: f64) -> Vec<usize> {
    let modes = &node.modes;
    let mut reaches: Vec<bool> = (0..modes.len())
        .map(|r| {
            let rise = node.slopes[r].re * width;
            // Also so for a slope that is not finite, as of a defective mode.
            !(modes[r].eigenvalue.re.abs() > MARGIN * rise.abs() + uncertainty(node, r))
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

/// Nodes in ascending order, and for each interval the modes within reach of the axis: (at its start, at its end).
#[derive(Debug, Default)]
struct Track {
    nodes: Vec<Node>,
    links: Vec<Vec<(usize, usize)>>,
}

/// The continuation of all modes within reach at either end, if it is safe.
fn link(from: &Node, to: &Node) -> Option<Vec<(usize, usize)>> {
    let width = to.value - from.value;
    let safely = |here: &Node, rows: &[usize], there: &Node| -> Option<Vec<usize>> {
        let (next, correlations) = here.continued_modes(rows, there);
        next.filter(|next| here.keeps_distances(rows, there, next, &correlations))
    };
    let rows = within_reach(from, width);
    let mut pairs: Vec<(usize, usize)> =
        rows.iter().copied().zip(safely(from, &rows, to)?).collect();
    let mut others = within_reach(to, width);
    others.retain(|s| pairs.iter().all(|pair| pair.1 != *s));
    pairs.extend(safely(to, &others, from)?.into_iter().zip(others));
    Some(pairs)
}

impl Track {
    fn refine(
        &mut self,
        path: WatchedPath<'_>,
        from: &Node,
        to: &Node,
        span: f64,
    ) -> Result<(), Error> {
        let width = to.value - from.value;
        let pairs = link(from, to);
        let settled = pairs.as_ref().is_some_and(|pairs| {
            width <= RESOLUTION * span
                || pairs.iter().all(|&(r, s)| real_part(from, to, r, s).is_settled())
        });
        if !settled
            && width > branches::RESOLUTION * span
            && let Some(node) = Node::between(path, from, to)?
        {
            self.refine(path, from, &node, span)?;
            let place = self.nodes.len();
            self.nodes.push(Node::default());
            let refined = self.refine(path, &node, to, span);
            self.nodes[place] = node;
            return refined;
        }
        // Where branches meet the axis is not crossed but left.
        self.links.push(pairs.unwrap_or_default());
        Ok(())
    }

    /// Adds what refines the interval up to `node`.
    fn append(&mut self, part: Track, node: Node) {
        self.nodes.extend(part.nodes);
        self.links.extend(part.links);
        self.nodes.push(node);
    }

    /// The sign of the real part of a mode of a node.
    fn sign(&self, node: usize, mode: usize) -> f64 {
        let node = &self.nodes[node];
        significant_sign(node.modes[mode].eigenvalue.re, uncertainty(node, mode))
    }

    /// Whether a mode within reach lies on the axis at the last node.
    fn ends_on_axis(&self) -> bool {
        let last = self.links.len();
        self.links.last().is_some_and(|link| link.iter().any(|pair| self.sign(last, pair.1) == 0.0))
    }

    /// The crossings in some intervals: ends of a bracket, the mode at the first end and the sign of its real part there.
    fn crossings(&self, intervals: Range<usize>) -> Vec<([&Node; 2], usize, f64)> {
        let mut crossings = Vec::new();
        for k in intervals {
            for &(r, s) in &self.links[k] {
                let before = self.sign(k, r);
                let (mut end, mut after) = (k + 1, self.sign(k + 1, s));
                if after == 0.0
                    && let Some(next) = self.links.get(k + 1)
                    && let Some(&(_, beyond)) = next.iter().find(|pair| pair.0 == s)
                {
                    // On the axis at a node.
                    (end, after) = (k + 2, self.sign(k + 2, beyond));
                }
                if before * after < 0.0 {
                    crossings.push(([&self.nodes[k], &self.nodes[end]], r, before));
                }
            }
        }
        crossings
    }
}
