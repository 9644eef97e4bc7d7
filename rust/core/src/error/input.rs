//! What can be wrong with a question.

/// Ill-posed input, found before any work starts. Every message names the argument and the value.
///
/// Fields of one name mean the same in all variants: `argument` is the name of an argument, `contact` the index of a contact, and
/// `combination` its statuses, one letter per contact. A matrix has `value` at (`row`, `column`) and `mirrored` at (`column`, `row`).
#[allow(missing_docs, reason = "those of fields stand once, above")]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// Work that was cancelled before it had an answer.
    #[error("cancelled")]
    Cancelled,
    /// An argument has the wrong shape, length or size.
    #[error("{argument}: expected {expected}, got {got}")]
    Shape {
        argument: String,
        /// What is expected, with its noun: `shape (2, 2)`, `at least one dof`.
        expected: String,
        /// What was given, in the form of `expected`.
        got: String,
    },
    /// Springs or dampers in a scene in which they are not computed.
    #[error("elements: springs and dampers are not computed beside {reason}")]
    Elements {
        /// What stands beside them, and the remedy.
        reason: &'static str,
    },
    /// A contact with a state in a scene in which it is not computed.
    #[error("contact {contact}: friction: friction with a state is not computed beside {reason}")]
    StateBeside {
        /// Index of the contact.
        contact: usize,
        /// What stands beside it, and the remedy.
        reason: &'static str,
    },
    /// Friction in a plane where it is not computed.
    #[error("contact {contact}: tangential: friction in a plane is not computed beside {reason}")]
    Plane {
        contact: usize,
        /// What stands beside it, and the remedy.
        reason: &'static str,
    },
    /// The two directions of friction in a plane with different statuses.
    #[error(
        "combination {combination:?}: contacts {contact} and {beside} are friction in one plane, so that both slip, 'o', or both stick, 's'"
    )]
    PlaneStatuses { contact: usize, beside: usize, combination: String },
    /// Formulas of force and rate that are no friction.
    #[error("contact {contact}: friction: {reason}")]
    StateFormulas { contact: usize, reason: String },
    /// A state in which the law of an element has no value.
    #[error("state: {element} has no finite force and slope there; start where its law is smooth")]
    UndefinedElement { element: String },
    /// A law of the stiffness of a contact in a scene in which it is not computed.
    #[error("contact {contact}: normal_stiffness: a law {reason}")]
    ContactLaw { contact: usize, reason: &'static str },
    /// A question whose answer needs the place at rest, which a sticking contact leaves open.
    #[error(
        "combination {combination:?}: the slope of springs depends on the place at rest, which contact {stuck} leaves open: it sticks to a slider without a speed; ask for a combination in which it slides or is open"
    )]
    PlaceAtRest {
        /// The contact that sticks.
        stuck: usize,
        combination: String,
    },
    /// Newton's method has not found where the structure rests.
    #[error(
        "combination {combination:?}: no state of rest with these springs was found, by Newton's method from the linear one; check their laws, or follow the rest from softer springs"
    )]
    NoRest { combination: String },
    /// The local method cannot compute the motion of this scene.
    #[error("method: 'local' does not work here: {reason}; use 'auto'")]
    NotLocal {
        /// What stands in the way.
        reason: &'static str,
    },
    /// Loads whose frequencies have no common period, so that no motion under them is periodic.
    #[error(
        "loads: {first} Hz and {second} Hz have no common period of at most a thousand of their own, so no motion under both is periodic"
    )]
    Incommensurate {
        /// Frequency of one load, Hz.
        first: f64,
        /// Frequency of another one, Hz.
        second: f64,
    },
    /// An entry of an argument is NaN or infinite.
    #[error("{argument}: must be finite, got {value} at {place}")]
    NotFinite {
        argument: String,
        /// Where the entry stands: `index 3`.
        place: String,
        /// The entry, NaN or infinite.
        value: f64,
    },
    /// A number lies outside the values allowed.
    #[error("{argument}: must be {requirement}, got {value}")]
    Range {
        argument: String,
        /// What the number must be: `>= 0`.
        requirement: &'static str,
        /// The number given, in the unit of the argument.
        value: f64,
    },
    /// A matrix that must be symmetric, or skew-symmetric, is not.
    #[error(
        "{argument}: must be {}, got {value} at ({row}, {column}) and {mirrored} at ({column}, {row}){}",
        if *skew { "skew-symmetric (A' = -A)" } else { "symmetric" },
        split(argument)
    )]
    NotSymmetric {
        argument: String,
        /// Whether it must be skew-symmetric.
        skew: bool,
        row: usize,
        column: usize,
        value: f64,
        mirrored: f64,
    },
    /// The mass matrix is not positive definite.
    #[error("mass: must be positive definite, got {value} as pivot of dof {dof}")]
    IndefiniteMass {
        /// Dof whose pivot is not positive.
        dof: usize,
        /// That pivot, or the lumped mass itself, kg.
        value: f64,
    },
    /// A sparse mass matrix is not positive definite.
    #[error("mass: must be positive definite, it is not at dof {dof}")]
    IndefiniteSparseMass {
        /// Dof at which its factorization ended.
        dof: usize,
    },
    /// A column index of a sparse matrix is out of range, repeated or not ascending in its row.
    #[error("{argument}: column index {index} in row {row} is outside 0..{size} or out of order")]
    SparseIndex {
        argument: String,
        /// Row of the index.
        row: usize,
        /// The column index given.
        index: i64,
        /// Number of rows and columns of the matrix.
        size: usize,
    },
    /// A direction of a contact has no entry but zero.
    #[error("contact {contact}: {direction}: must not be zero")]
    ZeroDirection {
        contact: usize,
        /// `tangential` or `normal`.
        direction: &'static str,
    },
    /// A contact has neither a tangential nor a normal direction.
    #[error("contact {contact}: must have a tangential or a normal direction, got none")]
    NoDirection { contact: usize },
    /// A contact cannot have a status, because it lacks a direction.
    #[error(
        "combination {combination:?}: contact {contact} has no {direction} direction, so its status is {expected}, got '{status}'"
    )]
    InadmissibleStatus {
        contact: usize,
        /// `tangential` or `normal`: the direction that it lacks.
        direction: &'static str,
        /// The letters that it can have.
        expected: &'static str,
        /// The letter given.
        status: char,
        /// The combination given.
        combination: String,
    },
    /// The two directions of a contact are multiples of each other.
    #[error(
        "contact {contact}: normal: must differ from the tangential direction, got a multiple of it"
    )]
    NormalIsTangential { contact: usize },
    /// Directions of contacts depend on each other but for less than elimination can tell from rounding.
    #[error(
        "contact {contact}: directions of contacts on its dofs are nearly parallel, neither independent nor dependent to rounding; give the same entries to directions that are to be the same, and move the others further apart"
    )]
    AlmostDependentDirections {
        /// Index of the first contact with a direction on these dofs.
        contact: usize,
    },
    /// Some contacts of a scene have no mass, and directions of others depend on each other.
    #[error(
        "contacts: some have no mass, and directions of others depend on each other, so that impacts of these are settled together with forces that follow at once; give those whose directions depend on each other a normal_stiffness and a tangential_stiffness, too, which makes their directions independent"
    )]
    DependentBesideMassless,
    /// In a combination the forces of closed contacts are not unique, and the motion depends on how they are split.
    #[error(
        "combination {combination:?}: the directions of its closed contacts depend on each other, and the motion depends on how their forces are split; give these contacts a stiffness, or a small mass of their own tied to the body by stiff springs"
    )]
    DependentForces { combination: String },
    /// Closed contacts share their forces in a way that takes more inequalities to state than are followed.
    #[error(
        "combination {combination:?}: the directions of its closed contacts depend on each other, and that some split of their forces holds takes more than {most} inequalities, the most that are followed; give fewer contacts, or give these a stiffness"
    )]
    ManySplits {
        combination: String,
        /// The largest number of inequalities that are followed.
        most: usize,
    },
    /// A status combination has an unknown letter or the wrong length.
    #[error(
        "combination: expected one letter of '+', '-', 's', 'd' per contact ({contacts} in all), got {got:?}"
    )]
    Combination {
        /// The text given.
        got: String,
        /// Number of contacts, so of letters expected.
        contacts: usize,
    },
    /// A combination lets a contact without friction stick.
    #[error(
        "combination: contact {contact} has friction 0 and can't stick, got 's' in {combination:?}"
    )]
    FrictionlessStick { contact: usize, combination: String },
    /// Steady sliding is asked for, but the slider of a contact rests.
    #[error(
        "contact {contact}: slider_speed is 0, so steady sliding has no direction; give the slider a speed, or the contact a status by combination"
    )]
    NoSlidingDirection { contact: usize },
    /// No choice of open contacts is an equilibrium of steady sliding.
    #[error(
        "sliding equilibrium: contact {contact} would pull, normal force {} N, and no equilibrium with open contacts was found",
        rounded(*normal_force)
    )]
    TensileEquilibrium {
        /// Index of a contact that would pull if all were closed.
        contact: usize,
        /// Its normal force then, N, negative: compression is positive.
        normal_force: f64,
    },
    /// The combination given has no steady sliding, because a closed contact would have to pull, or an open one
    /// penetrates.
    #[error(
        "combination: no steady sliding in {combination:?}, where contact {contact} would {} {}; {}",
        if *open { "penetrate, gap" } else { "pull, normal force" },
        format_args!("{} {}", rounded(*margin), if *open { "m" } else { "N" }),
        advice(combination, admissible.as_deref())
    )]
    NoSteadySliding {
        contact: usize,
        /// Its normal force, N, or its gap, m, where it is open; negative.
        margin: f64,
        /// Whether it is open in the combination.
        open: bool,
        combination: String,
        /// The combination with open contacts in which the structure is in equilibrium under the static load, if there is one.
        admissible: Option<String>,
    },
    /// The reduced stiffness is singular, so the sliding equilibrium is not unique.
    #[error(
        "sliding equilibrium: the stiffness of combination {combination:?} is singular (reciprocal condition {reciprocal_condition:e}), so there is no unique one"
    )]
    SingularStiffness {
        combination: String,
        /// Estimated reciprocal condition of the scaled stiffness, -; 0 if the stiffness is exactly singular.
        reciprocal_condition: f64,
    },
    /// Matrices do not fit into memory.
    #[error("{what}, {size} by {size}, do not fit into the memory of this machine; {remedy}")]
    Memory { what: &'static str, size: usize, remedy: &'static str },
    /// Modes are asked for in a combination in which one contact slides by a law of friction and another one sticks.
    #[error(
        "combination {combination:?}: friction of contact {contact} depends on its slip velocity and contact {stuck} sticks, so there is no steady state about which motions are linear"
    )]
    NoSteadyState {
        /// The contact with the law.
        contact: usize,
        /// The contact that sticks.
        stuck: usize,
        combination: String,
    },
    /// Modes are asked for where friction depends on slip speed.
    #[error(
        "method 'modal': combination {combination:?} has no modes of finite motion, as friction of contact {contact} depends on slip speed; use 'auto' or 'taylor'"
    )]
    NonlinearPhase {
        combination: String,
        /// The contact with the law.
        contact: usize,
    },
    /// Modes are asked for where an element is not linear.
    #[error(
        "method 'modal': combination {combination:?} has no modes of finite motion, as {element} is not linear; use 'auto' or 'taylor'"
    )]
    NonlinearElement {
        combination: String,
        /// The spring or damper.
        element: String,
    },
    /// The motion depends on a split of contact forces that nothing determines, as friction depends on slip speed.
    #[error(
        "contact {contact}: nothing determines how the forces of closed contacts are split, and the motion depends on it, as its friction follows its own slip speed; give these contacts a stiffness, or one law if they slip alike"
    )]
    UndeterminedFrictionLaw {
        /// The contact that slides by the law.
        contact: usize,
    },
    /// Steady sliding where a law levels off and slip has no mass.
    #[error(
        "contact {contact}: its friction levels off at the slip speed {speed} m/s of steady sliding, and without mass in the tangential direction no small motion about it follows; state a law that rises there, or give the dofs mass"
    )]
    LevelSteadySliding {
        contact: usize,
        /// Slip speed of steady sliding, m/s.
        speed: f64,
    },
    /// Friction depends on slip speed where slip has no mass.
    #[error(
        "contact {contact}: friction: a law over slip speed needs mass in the tangential direction: {}; leave tangential_stiffness out, give the dofs mass, or state constant friction",
        if *falls {
            "without it, no quasi-static motion follows from friction that falls with slip speed"
        } else {
            "without it, no slip speed follows where friction does not rise with it"
        }
    )]
    LawWithoutMass {
        contact: usize,
        /// Whether its friction falls with slip speed somewhere.
        falls: bool,
    },
    /// In the position given a contact has a negative gap.
    #[error("position: contact {contact} penetrates, gap {} m", rounded(*gap))]
    Penetration {
        contact: usize,
        /// Its gap, m, negative: an open contact has a positive one.
        gap: f64,
    },
    /// The state given contradicts the status of a contact in the combination.
    #[error(
        "{argument}: contact {contact} is {status:?} in the combination, but its {quantity} is {}{}",
        rounded(*value),
        fitting(*status, quantity, *value)
    )]
    ViolatedStatus {
        /// Name of the argument that contradicts it.
        argument: &'static str,
        contact: usize,
        /// Letter of its status.
        status: char,
        /// Name of the quantity that contradicts the status: `gap`, `slip velocity`, ...
        quantity: &'static str,
        /// Value of that quantity, SI.
        value: f64,
    },
    /// Modal propagation is asked for, but the modes of a combination are too close to defective for it.
    #[error(
        "method: {method:?} can't propagate combination {combination:?}, whose modes are defective (condition {condition:e}); use \"taylor\" or \"auto\""
    )]
    DefectiveModes {
        /// Name of the method asked for.
        method: &'static str,
        combination: String,
        /// Largest condition number of its eigenvalues, -.
        condition: f64,
    },
    /// The reduced mass matrix of a combination is singular, so its acceleration is not unique.
    #[error(
        "the reduced mass matrix of combination {combination:?} is singular (pivot {pivot:e}): with this friction and mass coupling the contact problem has no unique acceleration"
    )]
    SingularMass {
        combination: String,
        /// Smallest relative pivot of that matrix, -.
        pivot: f64,
    },
    /// A tangential stiffness without a normal one.
    #[error(
        "contact {contact}: tangential_stiffness: needs normal_stiffness, too, or a given normal_force; at a rigid contact the normal force jumps, and with it the place of a node that slides"
    )]
    RigidNormal { contact: usize },
    /// A contact without mass has a restitution, so it would have to bounce.
    #[error(
        "contact {contact}: restitution: must be 0 where the contact has no mass, got {restitution}; its gap closes without an impact, and nothing bounces"
    )]
    RestitutionWithoutMass {
        contact: usize,
        /// The value given.
        restitution: f64,
    },
    /// The springs do not hold the dofs without mass.
    #[error(
        "stiffness: must be positive definite over the dofs without mass, which follow the others at once; coordinate {coordinate} has the pivot {pivot:e}"
    )]
    FloatingBoundary {
        /// Index of the coordinate.
        coordinate: usize,
        /// Pivot of the factorization there, N/m.
        pivot: f64,
    },
    /// A force depends on the velocity of a dof without mass.
    #[error(
        "{argument}: entry at dof {dof}, which has no mass: its velocity jumps; state damping=Proportional(...), which is formed from the mass and the stiffness that the dofs with mass feel, or give the dof a mass"
    )]
    RateWithoutMass {
        /// The matrix: `damping`, `gyroscopic` or `circulatory`.
        argument: &'static str,
        /// Index of the dof.
        dof: usize,
    },
    /// A scene mixes dofs with and without mass where either all or none of them must have mass.
    #[error("contact {contact}: {reason}")]
    MixedMass {
        contact: usize,
        /// What is mixed, and what to do.
        reason: &'static str,
    },
    /// The dofs without mass have no unique place in a combination.
    #[error(
        "combination {combination:?}: the places of the dofs without mass are not unique (pivot {pivot:e}): with this friction and stiffness the quasi-static contact problem is singular"
    )]
    SingularBoundary {
        combination: String,
        /// Smallest relative pivot of their equations, -.
        pivot: f64,
    },
    /// The eigenvalue iteration of a combination did not converge.
    #[error(
        "the eigenvalues of combination {combination:?} did not converge: relative residual {residual:e}"
    )]
    Eigenvalues {
        combination: String,
        /// Relative residual of the first mode that did not converge, -; NaN where the iteration gave no eigenvalue.
        residual: f64,
    },
    /// `impact_friction` is false though mass couples normal with tangential directions.
    #[error(
        "impact_friction: must be true where mass couples normal with tangential directions, as here: an impulse in a normal direction changes tangential velocities, which therefore can't stay unchanged; or give the dofs of contacts lumped mass by Body.lumped(), which suffices where all pairs that share a node have one normal, or by fe.reduce(boundary='lumped') or 'massless'"
    )]
    CoupledImpacts,
    /// A time asked for lies outside the computed motion.
    #[error("{argument}: {value} s lies outside the computed motion, 0 to {end} s")]
    TimeOutside {
        argument: &'static str,
        /// The time given, s.
        value: f64,
        /// End of the computed motion, s; it begins at 0.
        end: f64,
    },
    /// A record was written in another format than the one that is read.
    #[error(
        "record: has format {format}, but this version of stickslip reads format {read}; restore it by the version that wrote it, or compute it again"
    )]
    RecordFormat {
        /// The format in which it was written.
        format: u32,
        /// The format that is read.
        read: u32,
    },
    /// A record read back does not describe a possible motion or orbit of the scene.
    #[error("record: {reason}")]
    Record {
        /// What does not fit, in words.
        reason: &'static str,
    },
}

impl Error {
    /// An argument that has another shape than it is to have.
    pub(crate) fn shape(argument: &str, expected: &str, got: String) -> Self {
        Self::Shape { argument: argument.to_owned(), expected: expected.to_owned(), got }
    }
}

pub(crate) fn refused(reason: &'static str) -> Error {
    Error::Record { reason }
}

/// How to divide an unsymmetric matrix between an argument that must be symmetric and its skew counterpart.
fn split(argument: &str) -> &'static str {
    match argument {
        "stiffness" => {
            "; a matrix A that is meant to be so splits into stiffness=(A + A') / 2 and circulatory=(A - A') / 2"
        }
        "damping" => {
            "; a matrix A that is meant to be so splits into damping=(A + A') / 2 and gyroscopic=(A - A') / 2"
        }
        _ => "",
    }
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

/// The letter that fits a velocity of a contact that slides in the combination.
fn fitting(status: char, quantity: &str, value: f64) -> &'static str {
    match (status, quantity) {
        ('+' | '-', "slip velocity") if value > 0.0 => "; give it the letter '-'",
        ('+' | '-', "slip velocity") if value < 0.0 => "; give it the letter '+'",
        ('+' | '-' | 'o', "gap velocity") if value > 0.0 => "; give it the letter 'd', as it opens",
        _ => "",
    }
}

/// A number to six significant digits.
pub(super) fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}
