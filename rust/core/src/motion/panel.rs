//! The event functions of a phase on one interval of time, as polynomials with error bounds.
//!
//! An error counts from the state with which the panel begins. Every sum, of an event function or of a row of the equation of
//! motion, is rounded by its number of operations times the sum of its absolute terms, so also where the terms cancel. What the
//! panels before in the same phase have rounded is allowed for by some operations more for each of them; nothing bounds how a
//! motion that grows carries it on.

use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE, ROW, crosswise};
use crate::numerics::interval::Interval;
use crate::numerics::simd::GROUP;

/// Largest |lambda| times width of a panel: cancellation costs e^3 ulp of the fastest mode.
pub(super) const REACH: f64 = 3.0;

/// Roundings that are allowed for each panel before.
const PER_PANEL: usize = 8;

/// Steps of Newton's method to a root of a sum of squares, and the largest one, of the panel.
const NEWTON: usize = 3;
const POLISHED: f64 = 1e-6;

/// The rounding of a sum with this many operations after a number of panels, relative to the sum of its absolute terms.
#[inline(always)]
pub(super) fn rounding(operations: usize, panels: u32) -> f64 {
    0.5 * f64::EPSILON * (operations + PER_PANEL * panels as usize) as f64
}

/// The event functions of a contact in a plane, whose squares add up with these factors: of one that sticks the forces along both
/// directions, and `mu_static N`.
#[derive(Debug, Clone)]
pub(crate) struct Cone {
    pub parts: Vec<(usize, f64)>,
}

/// Event functions on one stretch of time `[start, start + width]`, as polynomials in
/// `s = (t - start) / width`.
#[derive(Debug, Default)]
pub(crate) struct Panel {
    pub width: f64,
    /// Functions that an envelope proves positive on the panel; they have no coefficients.
    pub excluded: Vec<bool>,
    /// `ROW` per function, of which the first `COEFFICIENTS` count.
    pub coefficients: Vec<f64>,
    /// Bound of the error of the whole polynomial on [0, 1]: remainder and rounding.
    pub error: Vec<f64>,
    /// The part of that bound that belongs to the coefficients from the second power on.
    pub curvature_error: Vec<f64>,
    /// Stretches passed over as a whole so far.
    pub leaps: usize,
    /// What sums of squares are made of: the function of the sum, its sign, and a polynomial.
    squares: Vec<(usize, f64, [f64; COEFFICIENTS])>,
}

impl Panel {
    /// The polynomial of a function in whole groups, after a root of known multiplicity at 0 is divided out.
    pub fn polynomial(&self, function: usize, multiplicity: usize) -> &[f64] {
        let first = function * ROW + multiplicity;
        let groups = (COEFFICIENTS - multiplicity).div_ceil(GROUP);
        &self.coefficients[first..first + groups * GROUP]
    }

    /// Whether all errors are numbers: else the motion has left their range.
    pub fn is_bounded(&self) -> bool {
        self.error.iter().sum::<f64>().is_finite()
    }

    /// The coefficients of a function, to be filled in.
    pub(super) fn row(&mut self, function: usize) -> &mut [f64; COEFFICIENTS] {
        self.coefficients[function * ROW..].first_chunk_mut().expect("a row per function")
    }

    /// Forms sums of squares, such as `(mu_static N)^2 - T_x^2 - T_y^2` of contacts that stick in planes, in place of their first
    /// parts; the other functions stand for nothing then.
    pub(super) fn form_cones(&mut self, cones: &[Cone]) {
        for Cone { parts } in cones {
            let Some((&(first, _), others)) = parts.split_first() else { continue };
            others.iter().for_each(|&(other, _)| self.excluded[other] = true);
            self.excluded[first] = self.is_positive(parts);
            if self.excluded[first] {
                continue;
            }
            let mut cone = [0.0; COEFFICIENTS];
            let (mut beyond, mut error, mut largest) = (0.0, 0.0, 0.0);
            for &(function, sign) in parts {
                let (row, off) = (*self.row(function), self.error[function]);
                let size: f64 = row.iter().map(|c| c.abs()).sum();
                self.squares.push((first, sign, row));
                for (k, c) in cone.iter_mut().enumerate() {
                    *c += sign * crosswise(&row[..=k], &row[..=k]);
                }
                for low in 1..COEFFICIENTS {
                    beyond += crosswise(&row[low..], &row[low..]).abs();
                }
                error += (2.0 * size + off) * off;
                largest += size * size;
            }
            let error = error + beyond + rounding(COEFFICIENTS + 1 + parts.len(), 0) * largest;
            let least = cone[0] + cone[1..].iter().map(|c| c.min(0.0)).sum::<f64>();
            *self.row(first) = cone;
            (self.error[first], self.curvature_error[first]) = (error, error);
            self.excluded[first] = least > error;
        }
    }

    /// Whether the ranges of functions on the panel prove the sum of their squares with some factors positive.
    fn is_positive(&self, parts: &[(usize, f64)]) -> bool {
        let (mut least, mut largest) = (0.0, 0.0);
        for &(function, factor) in parts {
            let (start, others) =
                (self.coefficients[function * ROW], &self.coefficients[function * ROW + 1..]);
            let (mut below, mut above) = (0.0, 0.0);
            for c in &others[..DEGREE] {
                below += c.min(0.0);
                above += c.max(0.0);
            }
            let off =
                self.error[function] + rounding(COEFFICIENTS, 0) * (start.abs() + above - below);
            let range = Interval { low: start + below - off, high: start + above + off };
            let farthest = factor * range.largest().powi(2);
            let nearest = factor * range.smallest().powi(2);
            least += f64::min(nearest, farthest);
            largest += farthest.abs();
        }
        least > rounding(ROW, 0) * largest
    }

    /// A root of a function; that of a sum of squares by Newton's method from the root that it has without its highest orders, which
    /// belong to twice the frequency of its parts.
    pub fn polished(&self, function: usize, root: f64) -> f64 {
        let mut at = root;
        for _ in 0..NEWTON {
            let parts = self.squares.iter().filter(|part| part.0 == function);
            let (value, slope) = parts.fold((0.0, 0.0), |(value, slope), (_, sign, row)| {
                let (p, dp) =
                    row.iter().rev().fold((0.0, 0.0), |(p, dp), c| (p * at + c, dp * at + p));
                (value + sign * p * p, slope + 2.0 * sign * p * dp)
            });
            let step = value / slope;
            // Where it has another multiplicity than one, the root stays what it is.
            if !(step.abs() <= POLISHED) {
                break;
            }
            at = (at - step).clamp(0.0, 1.0);
        }
        if (at - root).abs() <= POLISHED { at } else { root }
    }

    #[inline]
    pub(super) fn reset(&mut self, width: f64, functions: usize) {
        self.width = width;
        self.squares.clear();
        if self.excluded.len() != functions {
            self.resize(functions);
        }
    }

    fn resize(&mut self, functions: usize) {
        self.excluded.resize(functions, false);
        self.coefficients.resize(functions * ROW, 0.0);
        self.error.resize(functions, 0.0);
        self.curvature_error.resize(functions, 0.0);
    }
}
