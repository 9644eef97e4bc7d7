//! The event-driven run, its trajectory, samples and batches.

pub(crate) mod batch;
pub(crate) mod clock;
pub(crate) mod impact_series;
pub(crate) mod local;
pub(crate) mod met_combinations;
pub(crate) mod parts;
pub(crate) mod repeated_run;
pub(crate) mod run;
pub(crate) mod run_state;
pub(crate) mod search;
pub(crate) mod simulate;
pub(crate) mod trajectory;

pub use batch::{Batch, Job, Outcome, RunSettings};
pub use local::record::LocalRecord;
pub use run_state::Controls;
pub use simulate::simulate;
pub use trajectory::events::{Accumulation, Counters, Event, Grazing, StopReason};
pub use trajectory::model::{Phase, Trajectory};
pub use trajectory::record::{MotionRecord, TrajectoryRecord};
pub use trajectory::sampling::{ModalRun, Sample};
