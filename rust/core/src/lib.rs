//! Friction-induced vibration of mechanical systems with frictional unilateral contacts.
//!
//! Data flows one way, and each step is a value of its own:
//! [`Scene`] → status [`Combination`] → [`Reduced`] matrices → [`Modes`] → [`Trajectory`] → [`Cycle`].
//! The equations are those of `docs/theory.md`; a prime on a matrix or vector is the plain transpose. SI units throughout.
//!
//! ```ignore
#![doc = include_str!("../examples/block_on_belt.rs")]
//! ```
//!
//! # Words
//!
//! The model:
//!
//! - *dof*: a degree of freedom x as the user numbers it. *Contact coordinate*: a coordinate q of the core, in which the
//!   gap and the tangential displacement of every contact are coordinates of their own.
//! - *gap*: distance of a contact from its slider, >= 0, m. *Clearance*: the gap at x = 0.
//! - *slider*: the rigid body that a contact touches; *slip velocity*: that of the contact less that of the slider, m/s.
//! - *normal force* N >= 0 and *friction force* T: the forces of the slider on the contact, N.
//! - *friction* mu and *static friction* mu_static: T / N while slipping, and its bound while sticking. *Law* of friction: mu
//!   over the slip speed, where it is no constant.
//! - *restitution* e: velocity after over velocity before an impact, in the normal direction.
//! - *status* of a contact: positive (`+`) or negative (`-`) sliding, sticking (`s`), detached (`d`). *Closed*: not
//!   detached. *Combination*: the statuses of all contacts.
//! - *reduction*: the equation of motion `L' M R` of one combination over the *kept* coordinates, those it leaves free.
//! - *lumped*: a diagonal mass. *Proportional* damping: `C = alpha M + beta K`. *Delassus matrix* W: accelerations of
//!   contacts per contact force, where mass couples them.
//! - *node*: the end of the springs of a *compliant* contact, without mass. *Massless* coordinates follow the others at once;
//!   a coordinate of *first order* is the slip of a node by a law, which has a velocity of its own and no mass.
//! - *dependent* directions: the gap or slip of one contact is a sum of those of others.
//! - *steady sliding*, *sliding equilibrium*: rest of the structure while all sliders move. *Block*: a part of a scene that
//!   nothing couples to the rest.
//!
//! Modes and what moves them:
//!
//! - *mode*: eigenvalue lambda (1/s) with right and left vector of a combination; *growth rate*: its real part; *condition*:
//!   by how much rounding of the matrices moves it. *Defective*: its vectors depend on each other.
//! - *pencil*: `lambda^2 M + lambda C + K`. *Residual*: its product with an eigenvector, relative to its terms.
//! - *held modes*: modes of the structure with held contacts, coordinates in which series of dense scenes move.
//! - *path*: a reduced problem along one parameter; *branch*: one eigenvalue followed along it; *sweep*: all of them on a
//!   mesh. *Hopf point*: a pair reaches the imaginary axis; *exceptional point*: two eigenvalues and their vectors meet;
//!   *separation*: steady sliding ends because a contact would pull.
//!
//! A motion:
//!
//! - *phase*: the motion in one combination, up to an event. *Propagator*: the method that computes a phase, by modes or by
//!   Taylor series. *Panel*: an interval of a phase on which the event functions are polynomials with an error bound.
//!   *Leap*: a long interval that is skipped because no event function can vanish on it.
//! - *event function*: a function of the state that is positive while a status holds. *Crossing*: the function falls through
//!   its error bound, which is an event. *Touch* or *grazing*: the function enters its error bound and leaves it upwards, so
//!   that rounding leaves the event undecided.
//! - *event*: slip ends (velocity), slip begins (`slip+`, `slip-`), release, impact, *accumulation*, the limit of infinitely
//!   many bounces, *closing*, an impact without mass, *jump*, the onset of slip of a node whose friction drops, and the switch of
//!   a load. *Trigger*: the event function that vanished. *Transition*: statuses and velocities after it.
//! - *departure*: the multiplicity with which an event function leaves zero after an event.
//! - *run*: the computation of phase after phase; *trajectory*: its result; *record*: the numbers from which a trajectory is
//!   restored to the last bit.
//!
//! Periodic motions:
//!
//! - *orbit*: a periodic motion of given events; *cycle*: an orbit with its stability. *Section*: the point at which an orbit
//!   starts, just after an event. *Passage*: the event at the end of a phase with its derivatives; *saltation*: the map by
//!   which an event changes the distance of a neighbouring motion.
//! - *monodromy*: derivative of the flow over a period; *multipliers*: its eigenvalues. *Shooting*: Newton's method on all
//!   phases at once. *Corner*: two events coincide, and the return map has one derivative on each side.
//! - *attractor*: what a motion settles to: equilibrium, cycle, or aperiodic with a *Lyapunov exponent*.
//! - *study*: questions to many scenes of one *family*.

#![deny(missing_docs)]

pub mod contact;
pub mod cycles;
pub mod energy;
pub mod error;
pub mod linalg;
pub mod locus;
pub mod modes;
pub mod motion;
pub mod numerics;
pub mod scene;
pub mod study;
pub mod transient;

pub use cycles::attractors::Attractor;
pub use cycles::orbits::Cycle;
pub use error::{Cancel, Error, RunFailure};
pub use modes::Modes;
pub use motion::{Method, Propagators};
pub use scene::{
    Combination, Contact, ContactInput, Direction, Reduced, Scene, SceneInput, State, Status,
};
pub use transient::{Controls, StopReason, Trajectory, simulate};
