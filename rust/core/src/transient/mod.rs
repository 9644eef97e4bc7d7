//! The event-driven run, its trajectory, samples and batches.

pub(crate) mod batch;
pub(crate) mod clock;
pub(crate) mod kept_states;
pub(crate) mod local;
pub(crate) mod parts;
pub(crate) mod record;
pub(crate) mod run;
pub(crate) mod run_state;
pub(crate) mod search;
pub(crate) mod simulate;
pub(crate) mod trajectory;

pub use batch::{Batch, Job, Outcome, RunSettings};
pub use local::record::LocalRecord;
pub use record::TrajectoryRecord;
pub use run_state::Controls;
pub use simulate::simulate;
pub use trajectory::{
    Accumulation, Counters, Event, Grazing, ModalRun, Sample, StopReason, Trajectory,
};
