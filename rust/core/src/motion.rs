//! The motion of one phase, as two kinds that answer the same question: on the next stretch of time,
//! what polynomial is each event function, and how far can it be off?

pub(crate) mod modal;
pub(crate) mod phi;
pub(crate) mod taylor;

use modal::ModalMotion;
use taylor::TaylorMotion;

/// Degree of the local polynomials. With panels of |lambda| width <= 3 the remainder
/// 3^29 / 29! = 8e-18 stays below rounding; a higher degree buys longer panels, but cancellation
/// costs e^3 ulp already.
pub(crate) const DEGREE: usize = 28;
/// Largest |lambda| times width of a panel.
pub(crate) const REACH: f64 = 3.0;
/// Coefficients per function.
pub(crate) const COEFFICIENTS: usize = DEGREE + 1;

/// Event functions on one stretch of time `[start, start + width]`, as polynomials in
/// `s = (t - start) / width`.
#[derive(Debug, Default)]
pub(crate) struct Panel {
    pub width: f64,
    /// `COEFFICIENTS` per function.
    pub coefficients: Vec<f64>,
    /// Bound of the error of the whole polynomial on [0, 1]: remainder and rounding.
    pub error: Vec<f64>,
    /// The part of that bound that belongs to the coefficients from the second power on.
    pub curvature_error: Vec<f64>,
}

impl Panel {
    pub fn polynomial(&self, function: usize) -> &[f64] {
        &self.coefficients[function * COEFFICIENTS..(function + 1) * COEFFICIENTS]
    }
}

/// A phase in progress. `start` is where its next panel begins, in local time.
#[derive(Debug)]
pub(crate) enum Motion<'a> {
    Modal(ModalMotion<'a>),
    Taylor(TaylorMotion<'a>),
}

impl Motion<'_> {
    /// Local time at which the next panel begins.
    pub fn start(&self) -> f64 {
        match self {
            Motion::Modal(motion) => motion.start(),
            Motion::Taylor(motion) => motion.start(),
        }
    }

    /// Fills `panel` with the event functions on the next stretch.
    pub fn expand(&mut self, panel: &mut Panel) {
        match self {
            Motion::Modal(motion) => motion.expand(panel),
            Motion::Taylor(motion) => motion.expand(panel),
        }
    }

    /// Moves on to the end of the panel last expanded.
    pub fn advance(&mut self) {
        match self {
            Motion::Modal(motion) => motion.advance(),
            Motion::Taylor(motion) => motion.advance(),
        }
    }

    /// (q, q') at `offset` after the start of the panel, written over `q` and `u`.
    pub fn state(&self, offset: f64, q: &mut [f64], u: &mut [f64]) {
        match self {
            Motion::Modal(motion) => motion.state(offset, q, u),
            Motion::Taylor(motion) => motion.state(offset, q, u),
        }
    }
}
