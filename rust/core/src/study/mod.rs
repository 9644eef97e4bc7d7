//! Many scenes of one family: parameters, questions and answers.

pub(crate) mod failure;
pub(crate) mod family;
pub(crate) mod fields;
pub(crate) mod motions;
pub(crate) mod questions;
pub(crate) mod verdicts;

pub use failure::{Failure, FailureKind};
pub use family::{Chain, Family, Template};
pub use fields::{Field, Slot};
pub use motions::{CycleEnergy, MotionAnswer, MotionQuestions, Settled, SettledKind};
pub use questions::{Answer, HopfRange, Questions, Samples, answers, pool};
pub use verdicts::verdicts;
