//! Matrices and statics along a path as Chebyshev series of their entries.

use nalgebra::{ComplexField, DMatrix};

use crate::modes::quadratic_pencil::DoubledRows;
use crate::numerics::double_double::Doubled;
use crate::scene::statics::margins::Statics;

/// A real or a complex parameter.
pub(crate) trait Number: ComplexField<RealField = f64> + Copy {}
impl<T: ComplexField<RealField = f64> + Copy> Number for T {}

/// Coefficients of `sum_k T_k(t) c_k` for matrices c_k of one shape, vectors as columns.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ChebyshevSeries(pub Vec<DMatrix<f64>>);

impl ChebyshevSeries {
    pub(crate) fn scalar(value: f64) -> Self {
        Self(vec![DMatrix::from_element(1, 1, value)])
    }

    /// `constant + t slope`; a slope of zero is left out.
    pub(crate) fn linear(constant: DMatrix<f64>, slope: DMatrix<f64>) -> Self {
        let moves = slope.iter().any(|&entry| entry != 0.0);
        Self(if moves { vec![constant, slope] } else { vec![constant] })
    }

    pub(crate) fn is_constant(&self) -> bool {
        self.0.len() == 1
    }

    /// An entry at t, carried in doubled precision (Clenshaw).
    pub(crate) fn doubled(&self, place: (usize, usize), t: f64) -> Doubled {
        if let [constant] = self.0.as_slice() {
            return constant[place].into();
        }
        if let [constant, slope] = self.0.as_slice() {
            if slope[place] == 0.0 {
                return constant[place].into();
            }
            return Doubled::product(slope[place], t).add(constant[place].into());
        }
        let (mut b1, mut b2) = (Doubled::default(), Doubled::default());
        for (k, coefficient) in self.0.iter().enumerate().rev() {
            let double = if k == 0 { t } else { 2.0 * t };
            let b0 = b1.times(double).add(b2.times(-1.0)).add(coefficient[place].into());
            (b2, b1) = (b1, b0);
        }
        b1
    }

    /// A square matrix at t, in doubled precision.
    pub(crate) fn rows(&self, t: f64) -> DoubledRows {
        let size = self.0.first().map_or(0, DMatrix::nrows);
        DoubledRows::new(size, |i, j| self.doubled((i, j), t))
    }

    /// In working precision.
    pub(crate) fn at(&self, t: f64) -> DMatrix<f64> {
        let (first, rest) = match self.0.as_slice() {
            [] => return DMatrix::default(),
            [constant] => return constant.clone(),
            [constant, slope] => {
                return constant.zip_map(slope, |constant, slope| slope * t + constant);
            }
            [first, rest @ ..] => (first, rest),
        };
        let mut b1 = DMatrix::zeros(first.nrows(), first.ncols());
        let mut b2 = b1.clone();
        for coefficient in rest.iter().rev() {
            b2 = &b1 * (2.0 * t) - b2 + coefficient;
            std::mem::swap(&mut b1, &mut b2);
        }
        b1 * t - b2 + first
    }

    pub(crate) fn value(&self, t: f64) -> f64 {
        self.doubled((0, 0), t).value()
    }

    /// (value, derivative to t) at a real or complex t, from `T_k` and `T_k' = k U_{k-1}`.
    pub(crate) fn expanded<T: Number>(&self, t: T) -> (DMatrix<T>, DMatrix<T>) {
        let (rows, columns) = self.0.first().map_or((0, 0), DMatrix::shape);
        let mut value = DMatrix::zeros(rows, columns);
        let mut slope = value.clone();
        let (mut chebyshev, mut next) = (T::one(), t);
        let (mut second, mut second_next) = (T::zero(), T::one());
        for (k, coefficient) in self.0.iter().enumerate() {
            let derivative = second.scale(k as f64);
            value.zip_apply(coefficient, |value, c| *value += chebyshev.scale(c));
            slope.zip_apply(coefficient, |slope, c| *slope += derivative.scale(c));
            (chebyshev, next) = (next, t.scale(2.0) * next - chebyshev);
            (second, second_next) = (second_next, t.scale(2.0) * second_next - second);
        }
        (value, slope)
    }
}

/// [`Statics`] along a path, as series of its entries.
#[derive(Debug, Clone)]
pub struct StaticSeries {
    /// Load, N, a column of m entries.
    pub load: ChebyshevSeries,
    /// Rows of the margins, one of m entries per contact; N/m of closed contacts, - of open ones.
    pub rows: ChebyshevSeries,
    /// Offsets of the margins, a column with one entry per contact; N of closed contacts, 0 of open ones.
    pub offsets: ChebyshevSeries,
    /// Slider speeds, m/s, a column with one entry per contact.
    pub speeds: ChebyshevSeries,
}

impl StaticSeries {
    /// From the statics at t = `lower` and at t = `upper`, linear between them; the load by a series of its own where
    /// the friction itself is moved, which changes L.
    pub(crate) fn linear(
        [from, to]: [Statics; 2],
        [lower, upper]: [f64; 2],
        load: Option<ChebyshevSeries>,
    ) -> Self {
        let between = |a: Vec<f64>, b: Vec<f64>| {
            let [a, b] = [a, b].map(|values| DMatrix::from_vec(values.len(), 1, values));
            let slope = (b - &a) / (upper - lower);
            ChebyshevSeries::linear(a - &slope * lower, slope)
        };
        Self {
            load: load.unwrap_or_else(|| between(from.load, to.load)),
            rows: ChebyshevSeries(vec![from.rows]),
            offsets: between(from.offsets, to.offsets),
            speeds: between(from.speeds, to.speeds),
        }
    }

    pub(crate) fn at(&self, t: f64) -> Statics {
        Statics {
            load: self.load.at(t).data.into(),
            rows: self.rows.at(t),
            offsets: self.offsets.at(t).data.into(),
            speeds: self.speeds.at(t).data.into(),
        }
    }
}
