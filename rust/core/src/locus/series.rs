//! Matrices and statics along a path as Chebyshev series of their entries.

use num_complex::Complex64;

use crate::numerics::double_double::Doubled;
use crate::scene::statics::Statics;

/// Coefficients of `sum_k T_k(t) c_k` for equally long vectors c_k.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Series(pub Vec<Vec<f64>>);

impl Series {
    pub(crate) fn constant(values: Vec<f64>) -> Self {
        Self(vec![values])
    }

    /// Entry `index` at t, carried in doubled precision (Clenshaw).
    pub(crate) fn doubled(&self, index: usize, t: f64) -> Doubled {
        if let [constant] = self.0.as_slice() {
            return constant[index].into();
        }
        if let [constant, slope] = self.0.as_slice() {
            if slope[index] == 0.0 {
                return constant[index].into();
            }
            return Doubled::product(slope[index], t).add(constant[index].into());
        }
        let (mut b1, mut b2) = (Doubled::default(), Doubled::default());
        for (k, coefficient) in self.0.iter().enumerate().rev() {
            let double = if k == 0 { t } else { 2.0 * t };
            let b0 = b1.times(double).add(b2.times(-1.0)).add(coefficient[index].into());
            (b2, b1) = (b1, b0);
        }
        b1
    }

    /// Every entry at t, in working precision.
    pub(crate) fn at(&self, t: f64) -> Vec<f64> {
        let (first, rest) = match self.0.as_slice() {
            [] => return Vec::new(),
            [first, rest @ ..] => (first, rest),
        };
        let (mut b1, mut b2) = (vec![0.0; first.len()], vec![0.0; first.len()]);
        for coefficient in rest.iter().rev() {
            for ((b1, b2), c) in b1.iter_mut().zip(&mut b2).zip(coefficient) {
                (*b1, *b2) = (2.0 * t * *b1 - *b2 + c, *b1);
            }
        }
        first.iter().zip(b1.iter().zip(&b2)).map(|(c, (b1, b2))| t * b1 - b2 + c).collect()
    }

    pub(crate) fn value(&self, t: f64) -> f64 {
        self.doubled(0, t).value()
    }

    /// (value, derivative to t) of every entry at a complex t, from `T_k` and `T_k' = k U_{k-1}`.
    pub(crate) fn expanded(&self, t: Complex64) -> (Vec<Complex64>, Vec<Complex64>) {
        let length = self.0.first().map_or(0, Vec::len);
        let mut value = vec![Complex64::default(); length];
        let mut slope = value.clone();
        let (mut chebyshev, mut next) = (Complex64::from(1.0), t);
        let (mut second, mut second_next) = (Complex64::default(), Complex64::from(1.0));
        for (k, coefficient) in self.0.iter().enumerate() {
            let derivative = k as f64 * second;
            for (i, &c) in coefficient.iter().enumerate() {
                value[i] += chebyshev * c;
                slope[i] += derivative * c;
            }
            (chebyshev, next) = (next, 2.0 * t * next - chebyshev);
            (second, second_next) = (second_next, 2.0 * t * second_next - second);
        }
        (value, slope)
    }
}

/// [`Statics`] along a path, as series of its entries.
#[derive(Debug, Clone)]
pub struct StaticSeries {
    pub load: Series,
    pub rows: Series,
    pub offsets: Series,
    pub speeds: Series,
}

impl StaticSeries {
    /// From the statics at t = `lower` and at t = `upper`, linear between them; the load besides by `load_slope` where
    /// the friction itself is moved, which changes L.
    pub(crate) fn linear(
        [from, to]: [Statics; 2],
        [lower, upper]: [f64; 2],
        load_slope: Option<(Vec<f64>, Vec<f64>)>,
    ) -> Self {
        let between = |a: Vec<f64>, b: Vec<f64>| {
            let slope: Vec<f64> =
                a.iter().zip(&b).map(|(a, b)| (b - a) / (upper - lower)).collect();
            let constant = a.iter().zip(&slope).map(|(a, slope)| a - slope * lower).collect();
            Series(vec![constant, slope])
        };
        Self {
            load: match load_slope {
                Some((constant, slope)) => Series(vec![constant, slope]),
                None => between(from.load, to.load),
            },
            rows: Series(vec![from.rows]),
            offsets: between(from.offsets, to.offsets),
            speeds: between(from.speeds, to.speeds),
        }
    }

    pub(crate) fn at(&self, t: f64) -> Statics {
        Statics {
            load: self.load.at(t),
            rows: self.rows.at(t),
            offsets: self.offsets.at(t),
            speeds: self.speeds.at(t),
        }
    }
}
