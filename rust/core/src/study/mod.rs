//! Many scenes of one family: parameters, questions and answers.

pub(crate) mod family;
pub(crate) mod questions;
pub(crate) mod verdicts;

pub use family::{Chain, Family, Field, Slot, Template};
pub use questions::{
    Answer, CycleEnergy, Failure, FailureKind, HopfRange, MotionAnswer, MotionQuestions, Questions,
    Samples, Settled, SettledKind, answers, pool,
};
pub use verdicts::verdicts;
