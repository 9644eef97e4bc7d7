//! Friction-induced vibration of mechanical systems with frictional unilateral contacts.
//!
//! Data flows one way, and each step is a value of its own:
//! [`Scene`] → status [`Combination`] → [`Reduced`] matrices → [`Modes`] → [`Trajectory`].
//!
//! The equations are those of `docs/theory.md`; a prime on a matrix or vector is the plain transpose.

#![forbid(unsafe_code)]

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
