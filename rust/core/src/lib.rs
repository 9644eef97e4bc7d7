//! Friction-induced vibration of mechanical systems with frictional unilateral contacts.
//!
//! Data flows one way, and each step is a value of its own:
//! [`Scene`] → status [`Combination`] → [`Reduced`] matrices → [`Modes`] → [`Trajectory`].
//!
//! The equations are those of `docs/theory.md`; a prime on a matrix or vector is the plain transpose.

#![forbid(unsafe_code)]

mod arclength;
mod arithmetic;
mod attractor;
mod banded;
mod basis;
mod batch;
mod blocks;
mod branches;
mod columns;
mod compensated;
mod complementarity;
mod contact;
mod coordinates;
mod cost;
mod critical;
mod cycle;
mod eigen;
mod eigenpair;
mod energy;
mod ensemble;
mod equilibrium;
mod error;
mod event;
mod exceptional;
mod family;
mod flow;
mod graded;
mod harmonics;
mod hopf;
mod inverse_iteration;
mod joint;
mod leading;
mod lyapunov;
mod matrix;
pub mod models;
mod modes;
mod motion;
mod orbit;
mod path;
mod pencil;
mod phase;
mod quadrature;
mod record;
mod recurrence;
mod reduction;
mod refinement;
mod roots;
mod saltation;
mod scene;
mod schur;
mod separation;
mod sharing;
mod shooting;
mod simulation;
mod spectrum;
mod stability;
mod start;
mod statics;
mod status;
mod study;
mod sweep;
mod trajectory;
mod transition;
mod vector;
mod work;

pub use arclength::{Correction, Sides, Tangent};
pub use arithmetic::arithmetic;
pub use attractor::{Attractor, Search, settle};
pub use batch::{Batch, Job, Outcome, RunSettings};
pub use contact::{Contact, ContactInput, Direction};
pub use critical::{CriticalKind, CriticalPoint, critical_points};
pub use cycle::{Cycle, Extremes, Margin, Stability};
pub use energy::EnergySample;
pub use ensemble::{Found, settle_all};
pub use error::{Error, RunFailure};
pub use family::{Chain, Family, Field, Slot, Template};
pub use harmonics::Harmonics;
pub use hopf::{HopfSearch, hopf_points};
pub use lyapunov::Lyapunov;
pub use matrix::SparseMatrix;
pub use modes::Modes;
pub use orbit::{Multipliers, Orbit, OrbitFailure, Step};
pub use path::{Path, PathDamping, Piece, Series};
pub use record::{CycleRecord, TrajectoryRecord};
pub use recurrence::Recurrence;
pub use reduction::Reduced;
pub use scene::{Damping, Mass, Scene, SceneInput, State};
pub use simulation::{Controls, Method, simulate};
pub use stability::{ChainSamples, Growth, Verdict};
pub use statics::{StaticSeries, Statics, Steady};
pub use status::{Combination, Status};
pub use study::{
    Answer, CycleEnergy, Failure, HopfRange, MotionAnswer, MotionQuestions, Questions, Samples,
    Settled, answers, pool,
};
pub use sweep::Sweep;
pub use trajectory::{
    Accumulation, Counters, Event, EventKind, Grazing, ModalRun, Sample, StopReason, Trajectory,
};
pub use work::{ImpactWork, PhaseWork, Works};
