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

    /// Takes p for the end on whose side it is, and proposes the next point: Newton's if it is inside, else the middle.
    /// None where no number is left inside, or Newton's method stands still.
    pub fn narrowed(&mut self, p: f64, is_low: bool, newton: f64) -> Option<f64> {
        *(if is_low { &mut self.low } else { &mut self.high }) = p;
        let inside = |x: f64| self.low < x && x < self.high;
        let next = if newton == p || inside(newton) { newton } else { self.middle() };
        (next != p && inside(next)).then_some(next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The root of `f` and how often it was evaluated.
    fn root(mut bracket: Bracket, f: impl Fn(f64) -> (f64, f64)) -> (f64, usize) {
        let mut p = bracket.middle();
        for count in 1.. {
            let (value, slope) = f(p);
            match bracket.narrowed(p, value < 0.0, p - value / slope) {
                Some(next) if value != 0.0 => p = next,
                _ => return (p, count),
            }
        }
        (p, usize::MAX)
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
