//! Parameter values at which two eigenvalues and their vectors coalesce, real ones and complex ones near the real axis.
//!
//! From a point on the real axis the course of two eigenvalues towards an exceptional point is a square root: the linear
//! course of their squared difference, `(lambda_r - lambda_s)^2`, predicts where it lies. Newton's method starts from the
//! nearest predictions first, and only from those that no point found explains.

use num_complex::Complex64;

use crate::error::input::Error;
use crate::locus::branches::Mesh;
use crate::locus::critical::exceptional_point::{ExceptionalPoint, exceptional_point};
use crate::locus::critical::point::{CriticalKind, CriticalPoint};
use crate::locus::watched_path::WatchedPath;

/// An exceptional parameter whose imaginary part is below this part of the range is real.
const REAL: f64 = 1e-11;
/// A point explains a prediction if it is nearer to the predicted place than this part of the predicted distance, in the
/// parameter and in the eigenvalue. Two points so near to each other are predicted separately by nodes nearer to them.
const EXPLAINED: f64 = 0.1;

/// Where a node predicts that two of its modes coalesce, or a mode and its conjugate.
struct Prediction {
    at: ExceptionalPoint,
    node: usize,
    mode: usize,
    /// Way to go in the parameter, and in the eigenvalue.
    shift: f64,
    distance: f64,
    /// Distance of the neighbours of the node.
    width: f64,
}

impl Prediction {
    fn is_explained_by(&self, point: &ExceptionalPoint) -> bool {
        (point.parameter - self.at.parameter).norm() <= EXPLAINED * self.shift
            && (point.eigenvalue - self.at.eigenvalue).norm() <= EXPLAINED * self.distance
    }
}

/// Lock-ins up to `imaginary` off the real axis that are none of the `divergences`, and how often Newton's method was
/// started for them.
pub(crate) fn lock_ins(
    path: WatchedPath<'_>,
    mesh: &Mesh,
    imaginary: f64,
    divergences: &[CriticalPoint],
) -> Result<(Vec<CriticalPoint>, usize), Error> {
    let (mut points, mut found): (Vec<ExceptionalPoint>, Vec<ExceptionalPoint>) =
        Default::default();
    let mut starts = 0;
    for prediction in predictions(mesh, imaginary) {
        if points.iter().any(|point| prediction.is_explained_by(point)) {
            continue;
        }
        path.go_on()?;
        starts += 1;
        let mode = &mesh.nodes[prediction.node].modes[prediction.mode];
        let reach = 4.0 * (prediction.shift + prediction.width);
        let point = exceptional_point(&path, prediction.at, &mode.right, &mode.left, reach);
        if let Some(point) = point {
            points.push(point);
            admit(point, &mut found, path.range(), imaginary);
        }
    }
    let largest = mesh.nodes[0].modes.iter().map(|mode| mode.eigenvalue.norm()).fold(0.0, f64::max);
    let (lower, upper) = path.range();
    // With damping in proportion to stiffness a pair that becomes static coalesces at zero: one event, not two.
    let is_divergence = |point: &ExceptionalPoint| {
        point.eigenvalue.norm() <= 1e-6 * largest
            && divergences
                .iter()
                .any(|other| (other.value - point.parameter.re).abs() <= 1e-8 * (upper - lower))
    };
    let lock_in = |ExceptionalPoint { parameter, eigenvalue }: ExceptionalPoint| {
        let point = CriticalPoint::at(CriticalKind::LockIn, parameter.re, eigenvalue, f64::NAN);
        CriticalPoint { complex_value: parameter, other: eigenvalue, ..point }
    };
    let found = found.into_iter().filter(|point| !is_divergence(point)).map(lock_in);
    Ok((found.collect(), starts))
}

/// The predictions from all pairs of modes, and from each mode with its conjugate, at every node, if they lead to a point
/// between the neighbours of the node; the nearest first.
fn predictions(mesh: &Mesh, imaginary: f64) -> Vec<Prediction> {
    let nodes = &mesh.nodes;
    let mut predictions = Vec::new();
    for (k, node) in nodes.iter().enumerate() {
        let before = nodes[k.saturating_sub(1)].value;
        let after = nodes[(k + 1).min(nodes.len() - 1)].value;
        let width = after - before;
        for r in 0..node.modes.len() {
            let value = node.modes[r].eigenvalue;
            for s in 0..=r {
                let (other, other_slope) = if s < r {
                    (node.modes[s].eigenvalue, node.slopes[s])
                } else {
                    (value.conj(), node.slopes[r].conj())
                };
                let difference = value - other;
                let shift = -difference / (2.0 * (node.slopes[r] - other_slope));
                let inside =
                    shift.re.abs() <= width && shift.im.abs() <= 2.0 * imaginary.max(width);
                if inside && difference != Complex64::default() {
                    let mean = 0.5 * (value + other + (node.slopes[r] + other_slope) * shift);
                    predictions.push(Prediction {
                        at: ExceptionalPoint { parameter: node.value + shift, eigenvalue: mean },
                        node: k,
                        mode: r,
                        shift: shift.norm(),
                        distance: difference.norm(),
                        width,
                    });
                }
            }
        }
    }
    predictions.sort_by(|a, b| a.shift.total_cmp(&b.shift));
    predictions
}

/// Keeps a new point inside the range, with the positive imaginary part of the two conjugate eigenvalues.
fn admit(
    point: ExceptionalPoint,
    found: &mut Vec<ExceptionalPoint>,
    (lower, upper): (f64, f64),
    imaginary: f64,
) {
    let ExceptionalPoint { mut parameter, mut eigenvalue } = point;
    if eigenvalue.im < 0.0 {
        (parameter, eigenvalue) = (parameter.conj(), eigenvalue.conj());
    }
    if parameter.im.abs() <= REAL * (upper - lower) {
        parameter.im = 0.0;
    }
    if parameter.re < lower || parameter.re > upper || parameter.im.abs() > imaginary {
        return;
    }
    let known = found.iter().any(|other| {
        (other.parameter - parameter).norm() <= 1e-8 * (upper - lower)
            && (other.eigenvalue - eigenvalue).norm() <= 1e-6 * eigenvalue.norm()
    });
    if !known {
        found.push(ExceptionalPoint { parameter, eigenvalue });
    }
}
