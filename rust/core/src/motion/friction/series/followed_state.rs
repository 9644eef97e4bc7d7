//! Bristles that relax so fast that no series in time holds for long: their deflection follows from a balance.
//!
//! With `u_c' = A_c + a_c y`, `y = mu(S) Z` and Z in proportion to u_c, a deflection that has relaxed is the one for which y holds
//! `u_c'` where it is,
//!
//! ```text
//! y_k = ((k + 1) / h u_{k+1} - A_k) / a_c,   Z = y / mu(S)
//! ```
//!
//! in every order k of the series: an asymptotic series in the time of relaxation. The u' of the first equation come from the Z of the
//! second one, formed before; both are formed again until nothing changes. What y then differs from `mu(S) Z` by is a defect like rounding,
//! and how far the deflection begins from where the panel does is an error that it begins with.

use crate::motion::friction::series::coefficients::{scale, size};
use crate::motion::taylor::motion::ORDERS;
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE};

/// The deflection of a contact, where it follows.
#[derive(Debug, Default)]
pub(crate) struct FollowedState {
    pub follows: bool,
    /// The time in the phase before which the deflection has not relaxed, s.
    pub relaxed_at: f64,
    /// u_c as the motion has it where the panel begins, and how far the panel begins from there.
    pub began: f64,
    pub apart: f64,
    /// u_c from the balance before, and by this one.
    taken: [f64; COEFFICIENTS],
    found: [f64; COEFFICIENTS],
    /// `y - mu(S) Z`
    defect: [f64; COEFFICIENTS],
}

/// What a balance needs of an order: A_k, `1 / h`, a_c, and `Z / u_c`.
pub(crate) struct Balance {
    pub known: f64,
    pub rate: f64,
    pub acceleration: f64,
    pub deflection: f64,
}

impl FollowedState {
    /// Begins with a deflection that does not change.
    pub fn begin(&mut self, began: f64) {
        (self.began, self.apart) = (began, 0.0);
        self.taken = [0.0; COEFFICIENTS];
        self.defect = [0.0; COEFFICIENTS];
    }

    /// y of order k from the balance, where `product` is the one of mu(S) and Z.
    #[inline(always)]
    pub fn order(&mut self, k: usize, of: &Balance, mu: &[f64; COEFFICIENTS], product: f64) -> f64 {
        let next = self.velocity(k + 1);
        let force = ((k + 1) as f64 * of.rate * next - of.known) / of.acceleration;
        let lower: f64 = (1..=k).map(|i| mu[i] * self.found[k - i]).sum();
        self.found[k] = (force / of.deflection - lower) / mu[0];
        if k == DEGREE {
            return product;
        }
        self.defect[k] = force - product;
        force
    }

    /// Takes the deflection that was found; its change, relative to the deflection.
    pub fn improve(&mut self) -> f64 {
        let change: f64 = self.found.iter().zip(&self.taken).map(|(a, b)| (a - b).abs()).sum();
        self.taken = self.found;
        self.apart = (self.taken[0] - self.began).abs();
        change / size(&self.taken)
    }

    /// u_c where the panel begins.
    pub fn first(&self) -> f64 {
        self.taken[0]
    }

    /// u_c of order k. Its row is a small difference of slip and y.
    pub fn velocity(&self, k: usize) -> f64 {
        self.taken.get(k).copied().unwrap_or(0.0)
    }

    /// A bound of the defect.
    pub fn defect(&self) -> f64 {
        size(&self.defect)
    }

    /// The same series for a shorter panel, from the powers of the factor.
    pub fn shorten(&mut self, powers: &[f64; ORDERS]) {
        scale(&mut self.taken, powers);
        scale(&mut self.defect, powers);
    }
}
