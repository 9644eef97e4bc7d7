//! Where steady sliding is lost along a path: the normal force of a closed contact, or the gap of an open one, passes
//! zero.
//!
//! The margins of the contacts (see [`crate::scene::statics`]) are rational functions of the parameter, with poles where the
//! stiffness is singular. They are bracketed as real parts are: an interval is halved until the cubic through values
//! and slopes at its ends leaves no room for further roots. A pole changes their sign as well; there bisection comes to
//! large margins instead of small ones.

use crate::linalg::dense::regular_solution;
use crate::linalg::parallel::in_parallel;
use crate::locus::critical::point::{CriticalKind, CriticalPoint, RESOLUTION, Stretch, UNDEFINED};
use crate::locus::parameter_path::Path;
use crate::locus::series::{ChebyshevSeries, StaticSeries};
use crate::numerics::bracket::Bracket;
use crate::scene::statics::margins::Steady;
use rayon::prelude::*;

/// Margins of all contacts at a parameter value.
type Point = (f64, Vec<MarginAt>);

/// The boundaries of steady sliding on a path that is looked at from `values`, ascending: every other contact holds.
pub(crate) fn separations(path: &Path, values: &[f64]) -> Vec<CriticalPoint> {
    let contacts = path.combination.statuses().len();
    let (lower, upper) = path.range();
    let resolution = RESOLUTION * (upper - lower);
    let at = |p: f64| path.margins(p).map(|margins| (p, margins));
    let known: Vec<Point> = values.iter().filter_map(|&value| at(value)).collect();
    let mut points = Vec::new();
    for contact in 0..contacts {
        for pair in known.windows(2) {
            let mut open = vec![(pair[0].clone(), pair[1].clone())];
            while let Some((from, to)) = open.pop() {
                let stretch = stretch(&from, &to, contact);
                let width = to.0 - from.0;
                let middle = (width > resolution && !stretch.is_settled())
                    .then(|| at(0.5 * (from.0 + to.0)))
                    .flatten();
                match middle {
                    Some(middle) => open.extend([(middle.clone(), to), (from, middle)]),
                    None => points.extend(boundary(path, contact, &from, &to)),
                }
            }
        }
    }
    points
}

fn stretch((p, from): &Point, (q, to): &Point, contact: usize) -> Stretch {
    let (from, to) = (from[contact], to[contact]);
    Stretch {
        value: [from.value, to.value],
        rise: [from.slope * (q - p), to.slope * (q - p)],
        uncertainty: [from.uncertainty, to.uncertainty],
    }
}

/// The root between two points of which the margin has unlike signs, if it is a boundary of steady sliding.
fn boundary(path: &Path, contact: usize, from: &Point, to: &Point) -> Option<CriticalPoint> {
    let (before, after) = (from.1[contact].value, to.1[contact].value);
    // Halves share their ends: a root at one belongs to the interval below it.
    if !(before < 0.0 && after >= 0.0 || before > 0.0 && after <= 0.0) {
        return None;
    }
    let mut bracket = Bracket { low: from.0, high: to.0 };
    let mut p = bracket.middle();
    let size = loop {
        let margin = path.margins(p)?[contact];
        let newton = p - margin.value / margin.slope;
        match bracket.narrowed(p, (margin.value < 0.0) == (before < 0.0), newton) {
            Some(next) if margin.value != 0.0 => p = next,
            _ => break margin.value.abs(),
        }
    };
    let Steady { mut margins, .. } = path.steady_at(p);
    *margins.get_mut(contact)? = 0.0;
    // At a zero that is an end itself the other end tells.
    let is_pole = size > before.abs().max(after.abs());
    if is_pole || !Steady::new(&path.combination, &path.speeds(p), margins).exists {
        return None;
    }
    let closed = path.combination.statuses()[contact].is_closed();
    let slope = if (after < before) == closed { 1.0 } else { -1.0 };
    Some(CriticalPoint::at(CriticalKind::Separation { contact }, p, UNDEFINED, slope))
}

/// A margin along a path: value, derivative to the parameter, and the rounding error of the value.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MarginAt {
    pub value: f64,
    pub slope: f64,
    pub uncertainty: f64,
}

impl Path {
    /// Whether steady sliding exists at parameter values.
    pub fn steady(&self, values: &[f64]) -> Vec<Steady> {
        in_parallel(|| {
            values.par_iter().with_min_len(64).map(|&value| self.steady_at(value)).collect()
        })
    }

    pub(crate) fn steady_at(&self, p: f64) -> Steady {
        let (piece, t) = self.place(p);
        piece.statics.at(t).steady(&self.combination, &piece.stiffness.at(t))
    }

    pub(crate) fn speeds(&self, p: f64) -> Vec<f64> {
        let (piece, t) = self.place(p);
        piece.statics.speeds.at(t).data.into()
    }

    /// The margins at p with their derivatives, `q' = K^-1 (F' - K' q)`; None where the stiffness is singular.
    pub(crate) fn margins(&self, p: f64) -> Option<Vec<MarginAt>> {
        let (piece, t) = self.place(p);
        let StaticSeries { load, rows, offsets, .. } = &piece.statics;
        let both = |series: &ChebyshevSeries| {
            let (value, slope) = series.expanded(t);
            (value, slope / piece.half_width)
        };
        let ((stiffness, stiffness_slope), (load, load_slope)) =
            (both(&piece.stiffness), both(load));
        let q = regular_solution(&stiffness, load.as_slice())?;
        let q_slope = regular_solution(&stiffness, (load_slope - stiffness_slope * &q).as_slice())?;
        let ((rows, rows_slope), (offsets, offsets_slope)) = (both(rows), both(offsets));
        let moved = &rows * q_slope + rows_slope * &q - offsets_slope;
        let margin = |i: usize| {
            let terms = rows.row(i).transpose().component_mul(&q);
            MarginAt {
                value: terms.sum() - offsets[i],
                slope: moved[i],
                uncertainty: 64.0 * f64::EPSILON * (terms.lp_norm(1) + offsets[i].abs()),
            }
        };
        Some((0..offsets.len()).map(margin).collect())
    }
}
