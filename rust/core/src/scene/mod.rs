//! The model as a value: matrices, contacts, statuses, and the linear system that a status combination leaves.

pub(crate) mod chain;
pub(crate) mod contact_law;
pub(crate) mod coordinates;
pub(crate) mod dependent;
pub(crate) mod elements;
pub(crate) mod equation_of_motion;
pub(crate) mod friction;
pub(crate) mod inertia;
pub(crate) mod input;
pub(crate) mod linear_terms;
pub(crate) mod loads;
pub(crate) mod massless;
pub(crate) mod model;
pub(crate) mod partition;
pub(crate) mod reduction;
pub(crate) mod statics;
pub(crate) mod status;

pub use chain::{DOFS, Link, Subsystem, chain};
pub use contact_law::{Contact, ContactInput, Direction, Directions, Springs};
pub use elements::element::{ElementInput, ElementKind, ElementPlace};
pub use elements::tangent::contact_stiffness;
pub use friction::bristles::{Bristles, Hysteresis};
pub use friction::contact_state::{ContactState, StateFormulas};
pub use friction::decay::Decay;
pub use friction::formula::{Formula, GivenOperation};
pub use friction::law::{FrictionLaw, Table};
pub use input::scene_input::{Damping, Mass, SceneInput};
pub use loads::input::{Harmonic, Loads, Steps, Vibration};
pub use model::{Scene, State};
pub use reduction::bases::Reduction;
pub use reduction::reduced_system::Reduced;
pub use statics::equilibrium::{Equilibrium, Uniqueness};
pub use statics::margins::{Statics, Steady};
pub use status::{Combination, Status};
