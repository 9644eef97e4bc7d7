//! A critical point, and functions of the parameter between two nodes whose roots are critical points.

use num_complex::Complex64;

use crate::locus::node::significant_sign;

/// Smallest interval of the search, of the whole range, for roots of real parts: two roots nearer to each other than
/// this, or a touch, are not told apart. Meeting branches are resolved further.
pub(crate) const RESOLUTION: f64 = 1e-7;

/// The kind of a critical point: the change of the eigenvalues, or of steady sliding, at a parameter value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum CriticalKind {
    /// A complex pair crosses the imaginary axis.
    Hopf,
    /// A real eigenvalue crosses zero.
    Divergence,
    /// Two eigenvalues coalesce, at a real or complex parameter.
    LockIn,
    /// The largest real part passes from one branch to another.
    Crossing,
    /// Steady sliding ends, or begins, because the normal force or the gap of a contact vanishes.
    Separation {
        /// Index of that contact.
        contact: usize,
    },
}

impl CriticalKind {
    /// The name of the kind in Python: `lock_in`.
    pub const fn name(self) -> &'static str {
        match self {
            CriticalKind::Hopf => "hopf",
            CriticalKind::Divergence => "divergence",
            CriticalKind::LockIn => "lock_in",
            CriticalKind::Crossing => "crossing",
            CriticalKind::Separation { .. } => "separation",
        }
    }
}

/// A parameter value at which stability, or steady sliding, changes.
#[derive(Debug, Clone)]
pub struct CriticalPoint {
    /// What happens there.
    pub kind: CriticalKind,
    /// The parameter, or its real part at a complex exceptional point.
    pub value: f64,
    /// The parameter in its own unit; its imaginary part is zero except at a complex exceptional point.
    pub complex_value: Complex64,
    /// The eigenvalue; at a crossing that of the branch that has the largest real part beyond it; NaN at a separation.
    pub eigenvalue: Complex64,
    /// The eigenvalue of the branch that loses the largest real part at a crossing, otherwise NaN.
    pub other: Complex64,
    /// Hopf: `d Re lambda / d p`; divergence: +1 or -1; crossing: the slope of the new branch less that of the old one;
    /// separation: +1 where the contact opens as the parameter grows, else -1.
    pub slope: f64,
}

impl CriticalPoint {
    /// At a real parameter value; no eigenvalue loses the largest real part there.
    pub(crate) fn at(kind: CriticalKind, value: f64, eigenvalue: Complex64, slope: f64) -> Self {
        let other = UNDEFINED;
        Self { kind, value, complex_value: value.into(), eigenvalue, other, slope }
    }
}

/// Stands for an eigenvalue or a vector that there is not.
pub(crate) const UNDEFINED: Complex64 = Complex64::new(f64::NAN, f64::NAN);

/// A function of the parameter between two nodes: values, slopes times width, uncertainties.
pub(crate) struct Stretch {
    pub value: [f64; 2],
    pub rise: [f64; 2],
    pub uncertainty: [f64; 2],
}

impl Stretch {
    pub fn minus(&self, other: &Self) -> Self {
        let each = |a: [f64; 2], b: [f64; 2], sign: f64| [a[0] + sign * b[0], a[1] + sign * b[1]];
        Self {
            value: each(self.value, other.value, -1.0),
            rise: each(self.rise, other.rise, -1.0),
            uncertainty: each(self.uncertainty, other.uncertainty, 1.0),
        }
    }

    pub fn signs(&self) -> [f64; 2] {
        [0, 1].map(|k| significant_sign(self.value[k], self.uncertainty[k]))
    }

    /// Whether its roots are known from its signs: none between like signs, one between unlike ones. The cubic through
    /// values and slopes leaves the chord by at most 4/27 of its excess slopes; twice that is allowed for the rest.
    pub fn is_settled(&self) -> bool {
        let chord = self.value[1] - self.value[0];
        let excess = self.rise.map(|rise| (rise - chord).abs());
        match self.signs() {
            [0.0, 0.0] => true,
            [a, b] if a == b => {
                self.value[0].abs().min(self.value[1].abs()) > 8.0 / 27.0 * (excess[0] + excess[1])
            }
            _ => excess[0].max(excess[1]) <= 0.5 * chord.abs(),
        }
    }
}
