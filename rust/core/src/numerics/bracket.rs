//! Newton's method kept inside a bracket: the one safeguard of scalar roots.

/// Two numbers between which a function passes zero.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bracket {
    pub low: f64,
    pub high: f64,
}

impl Bracket {
    pub fn middle(self) -> f64 {
        0.5 * (self.low + self.high)
    }

    /// The root of a function, to `resolution`. `ends` are its values at the two ends, of opposite signs; Newton's method
    /// starts where the chord passes zero, with the (value, slope) that `at` gives.
    pub fn root(mut self, ends: [f64; 2], resolution: f64, at: impl Fn(f64) -> (f64, f64)) -> f64 {
        let mut p = self.low + (self.high - self.low) * (ends[0] / (ends[0] - ends[1]));
        loop {
            let (value, slope) = at(p);
            let step = -value / slope;
            match self.narrowed(p, (value < 0.0) == (ends[0] < 0.0), p + step) {
                // A comparison that goes on where the slope is zero.
                Some(next) if value != 0.0 && !(step.abs() <= resolution) => p = next,
                _ => return p,
            }
        }
    }

    /// Makes p the end on whose side of the root it lies, and proposes the next point: Newton's if it lies inside, else the
    /// middle. None if no number is left inside, or Newton's method does not move any more.
    pub fn narrowed(&mut self, p: f64, is_low: bool, newton: f64) -> Option<f64> {
        *(if is_low { &mut self.low } else { &mut self.high }) = p;
        let inside = |x: f64| self.low < x && x < self.high;
        let next = if newton == p || inside(newton) { newton } else { self.middle() };
        (next != p && inside(next)).then_some(next)
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    /// The root of `f` and how often it was evaluated.
    fn root(bracket: Bracket, f: impl Fn(f64) -> (f64, f64)) -> (f64, usize) {
        let count = Cell::new(0);
        let ends = [bracket.low, bracket.high].map(|x| f(x).0);
        let root = bracket.root(ends, 0.0, |x| {
            count.set(count.get() + 1);
            f(x)
        });
        (root, count.get())
    }

    #[test]
    fn is_quadratic_where_newton_is_and_halves_elsewhere() {
        let (square_root, count) =
            root(Bracket { low: 1.0, high: 2.0 }, |x| (x * x - 2.0, 2.0 * x));
        assert!((square_root - 2.0_f64.sqrt()).abs() <= 2.0 * f64::EPSILON && count <= 8);
        // Newton's method runs away from this root; a step that stays inside is followed by one that halves, and a bracket
        // of doubles halves at most 60 times.
        let (cube, count) = root(Bracket { low: 0.3, high: 2.0 }, |x: f64| {
            ((x - 1.0).cbrt(), (x - 1.0).cbrt().powi(-2) / 3.0)
        });
        assert!((cube - 1.0).abs() <= 2.0 * f64::EPSILON && count <= 120);
    }
}
