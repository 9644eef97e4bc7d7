//! What can be wrong with a question, and what can stop a run.

use std::any::Any;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};

/// Ill-posed input, found before any work starts. Every message names the argument and the value.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    #[error("{argument}: expected {expected}, got {got}")]
    Shape {
        argument: String,
        /// With its noun: `shape (2, 2)`, `at least one dof`.
        expected: String,
        got: String,
    },
    #[error("{argument}: must be finite, got {value} at {place}")]
    NotFinite { argument: String, place: String, value: f64 },
    #[error("{argument}: must be {requirement}, got {value}")]
    Range { argument: String, requirement: &'static str, value: f64 },
    #[error(
        "{argument}: must be symmetric, got {value} at ({row}, {column}) and {mirrored} at ({column}, {row})"
    )]
    NotSymmetric { argument: String, row: usize, column: usize, value: f64, mirrored: f64 },
    #[error("mass: must be positive definite, got {value} as pivot of dof {dof}")]
    IndefiniteMass { dof: usize, value: f64 },
    #[error("{argument}: column index {index} in row {row} is outside 0..{size} or out of order")]
    SparseIndex { argument: String, row: usize, index: i64, size: usize },
    #[error("contact {contact}: {direction}: must not be zero")]
    ZeroDirection { contact: usize, direction: &'static str },
    #[error(
        "contact {contact}: normal: must differ from the tangential direction, got a multiple of it"
    )]
    NormalIsTangential { contact: usize },
    #[error(
        "contacts: {} for {} independent directions, {}; give each contact a small mass of its own, tied to the body by stiff springs",
        counted(*contacts, "contact asks", "contacts ask"),
        2 * contacts,
        counted(*dofs, "dof has 1", &format!("dofs have {dofs}"))
    )]
    TooManyDirections { contacts: usize, dofs: usize },
    #[error(
        "contacts: the {direction} direction of contact {contact} depends on the directions of the other contacts; give each contact a small mass of its own, tied to the body by stiff springs"
    )]
    DependentDirection { contact: usize, direction: &'static str },
    #[error(
        "combination: expected one letter of '+', '-', 's', 'd' per contact ({contacts} in all), got {got:?}"
    )]
    Combination { got: String, contacts: usize },
    #[error(
        "combination: contact {contact} has friction 0 and can't stick, got 's' in {combination:?}"
    )]
    FrictionlessStick { contact: usize, combination: String },
    #[error(
        "contact {contact}: slider_speed is 0, so steady sliding has no direction; give the slider a speed, or the contact a status by combination"
    )]
    NoSlidingDirection { contact: usize },
    #[error(
        "sliding equilibrium: contact {contact} would pull, normal force {} N; the static load opens it",
        rounded(*normal_force)
    )]
    TensileEquilibrium { contact: usize, normal_force: f64 },
    #[error(
        "combination: no steady sliding in {combination:?}, where contact {contact} would pull, normal force {} N; {}",
        rounded(*normal_force),
        advice(combination, admissible.as_deref())
    )]
    NoSteadySliding {
        contact: usize,
        normal_force: f64,
        combination: String,
        /// The one with open contacts in which the static load finds its equilibrium, where there is one.
        admissible: Option<String>,
    },
    #[error(
        "sliding equilibrium: the stiffness of combination {combination:?} is singular (reciprocal condition {reciprocal_condition:e}), so there is no unique one"
    )]
    SingularStiffness { combination: String, reciprocal_condition: f64 },
    #[error("position: contact {contact} penetrates, gap {} m", rounded(*gap))]
    Penetration { contact: usize, gap: f64 },
    #[error(
        "{argument}: contact {contact} is {status:?} in the combination, but its {quantity} is {}",
        rounded(*value)
    )]
    ViolatedStatus {
        argument: &'static str,
        contact: usize,
        status: char,
        quantity: &'static str,
        value: f64,
    },
    #[error(
        "method: {method:?} can't propagate combination {combination:?}, whose modes are defective (condition {condition:e}); use \"taylor\" or \"auto\""
    )]
    DefectiveModes { method: &'static str, combination: String, condition: f64 },
    #[error(
        "the reduced mass matrix of combination {combination:?} is singular (pivot {pivot:e}): with this friction and mass coupling the contact problem has no unique acceleration"
    )]
    SingularMass { combination: String, pivot: f64 },
    #[error(
        "the eigenvalues of combination {combination:?} did not converge: relative residual {residual:e}"
    )]
    Eigenvalues { combination: String, residual: f64 },
    #[error(
        "impact_friction: must be true where mass couples contacts, as here; an impulse on one contact moves the others, so their tangential velocities can't stay unchanged"
    )]
    CoupledImpacts,
    #[error("{argument}: {value} s lies outside the computed motion, 0 to {end} s")]
    TimeOutside { argument: &'static str, value: f64, end: f64 },
    #[error("record: {reason}")]
    Record { reason: &'static str },
}

/// A number of things with the noun and verb that go with it.
fn counted(count: usize, one: &str, several: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { several })
}

fn advice(combination: &str, admissible: Option<&str>) -> String {
    match admissible {
        Some(open) => format!(
            "the static load opens it: pass combination=\"{open}\", in which the structure is in equilibrium"
        ),
        None => format!(
            "no equilibrium was found with contacts open either: pass combination=\"{combination}\" for the modes of contacts held closed"
        ),
    }
}

/// A number to six significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

/// What the unknown forces of a contact problem change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// Forces, with static friction as the bound of what sticks.
    Accelerations,
    /// The impulses of an impact, with kinetic friction alone.
    Impulses,
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Level::Accelerations => "accelerations",
            Level::Impulses => "impulses",
        })
    }
}

/// Why a motion could not be continued; the part computed so far is kept beside it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RunFailure {
    #[error(transparent)]
    Input(#[from] Error),
    #[error(
        "contact {contact} at t = {time} s: no status is consistent with the state after the event (normal force {} N, required friction {} N)",
        rounded(*normal_force),
        rounded(*required_friction)
    )]
    NoConsistentStatus { contact: usize, time: f64, normal_force: f64, required_friction: f64 },
    #[error(
        "contacts {contacts:?} at t = {time} s: the contact problem of their {level} has {count} (Painleve); state after the event: slip velocities {slip:?} m/s, reactions {reactions:?} N"
    )]
    ContactProblem {
        contacts: Vec<usize>,
        time: f64,
        level: Level,
        /// "no solution" or "several solutions".
        count: &'static str,
        slip: Vec<f64>,
        /// (tangential, normal) of each contact.
        reactions: Vec<f64>,
    },
    /// Why a motion read back from its record could not be continued, in the words of then.
    #[error("{0}")]
    Recorded(String),
    /// A defect of the program, in the words of the panic that it caused.
    #[error("internal error: {0}")]
    Internal(String),
}

impl RunFailure {
    /// What `work` returns. A panic in one of many pieces of work is the failure of that piece: the others go on.
    pub fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, Self> {
        catch_unwind(AssertUnwindSafe(work)).map_err(Self::of_panic)
    }

    /// The failure of a thread that panicked.
    pub fn of_panic(panic: Box<dyn Any + Send>) -> Self {
        let text = panic.downcast_ref::<&str>().map(|&text| text.to_owned());
        let message = text.or_else(|| panic.downcast_ref::<String>().cloned());
        Self::Internal(message.unwrap_or_default())
    }
}

/// A request to stop, seen by all the work that holds the token: runs look at it every few dozen panels, searches and
/// studies between their steps. What was computed by then is kept.
#[derive(Debug, Default)]
pub struct Cancel {
    requested: AtomicBool,
    /// Asked by those who look, until it says yes once.
    ask: Option<fn() -> bool>,
}

impl Cancel {
    /// A token that also stops work once `ask` says so.
    pub const fn asking(ask: fn() -> bool) -> Self {
        Self { requested: AtomicBool::new(false), ask: Some(ask) }
    }

    /// Stops all the work that holds the token.
    pub fn request(&self) {
        self.requested.store(true, Ordering::Relaxed);
    }

    /// Whether work is to stop; once it is, it stays so.
    pub fn is_requested(&self) -> bool {
        if !self.requested.load(Ordering::Relaxed) && self.ask.is_some_and(|ask| ask()) {
            self.request();
        }
        self.requested.load(Ordering::Relaxed)
    }
}
