//! Many runs on all cores, handed out in the order they came in.
//!
//! A run depends only on its own scene and start, so no result depends on the number of threads. Memory holds the runs that
//! were submitted and not yet handed out: the caller decides how many these are.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use crate::error::cancel::Cancel;
use crate::error::run::RunFailure;
use crate::motion::method::Method;
use crate::motion::propagators::Propagators;
use crate::scene::model::{Scene, State};
use crate::transient::run_state::Controls;
use crate::transient::simulate::simulate;
use crate::transient::trajectory::model::Trajectory;

/// Settings that all runs of a batch share.
#[derive(Debug, Clone, Copy)]
pub struct RunSettings {
    /// s
    pub duration: f64,
    /// How phases are propagated.
    pub method: Method,
    /// Controls of each run; all runs stop with the batch.
    pub controls: Controls<'static>,
}

/// One run: a scene and where it starts.
#[derive(Debug, Clone)]
pub struct Job {
    /// The scene that moves; successive jobs of one scene share its decompositions.
    pub scene: Arc<Scene>,
    /// None: the sliding equilibrium of the scene.
    pub start: Option<State>,
    /// Added to the start, over dofs.
    pub added_position: Vec<f64>,
    /// Added to the velocity of the start, over dofs, m/s.
    pub added_velocity: Vec<f64>,
}

/// The start and the motion from it, or why there is none.
pub type Outcome = Result<(State, Trajectory), RunFailure>;

/// Runs in progress on a pool of threads; dropping it stops them.
#[derive(Debug)]
pub struct Batch {
    pool: ThreadPool,
    settings: RunSettings,
    cancel: Arc<Cancel>,
    pending: VecDeque<Receiver<Outcome>>,
    /// The propagators of the scene submitted last, which the next job may share.
    shared: Option<Arc<Propagators>>,
}

impl Batch {
    /// `threads`: None for one per core.
    pub fn new(
        settings: RunSettings,
        threads: Option<usize>,
    ) -> Result<Self, ThreadPoolBuildError> {
        Ok(Self {
            pool: ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0)).build()?,
            settings,
            cancel: Arc::default(),
            pending: VecDeque::new(),
            shared: None,
        })
    }

    /// Number of threads of the batch.
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Runs submitted and not yet handed out.
    pub fn pending(&self) -> usize {
        self.pending.len()
    }

    /// Puts a run at the end of the queue; it begins as soon as a thread is free.
    pub fn submit(&mut self, job: Job) {
        let propagators = match &self.shared {
            Some(shared) if Arc::ptr_eq(shared.bare(), &job.scene) => Arc::clone(shared),
            _ => Arc::new(Propagators::new(Arc::clone(&job.scene))),
        };
        self.shared = Some(Arc::clone(&propagators));
        let (sender, receiver) = sync_channel(1);
        let (settings, cancel) = (self.settings, Arc::clone(&self.cancel));
        self.pool.spawn_fifo(move || {
            let outcome = RunFailure::guarded(|| run(&propagators, job, settings, &cancel))
                .unwrap_or_else(Err);
            // Nobody waits any more when the batch was dropped.
            let _ = sender.send(outcome);
        });
        self.pending.push_back(receiver);
    }

    /// The outcome of the oldest run not yet handed out, if there is one and it is ready within `patience`.
    pub fn collect(&mut self, patience: Duration) -> Option<Outcome> {
        let outcome = match self.pending.front()?.recv_timeout(patience) {
            Ok(outcome) => outcome,
            Err(RecvTimeoutError::Timeout) => return None,
            Err(RecvTimeoutError::Disconnected) => {
                Err(RunFailure::Internal("the run ended without an outcome".into()))
            }
        };
        self.pending.pop_front();
        Some(outcome)
    }

    /// Stops every run in progress or waiting; each is handed out as far as it came.
    pub fn stop(&self) {
        self.cancel.request();
    }
}

impl Drop for Batch {
    fn drop(&mut self) {
        self.stop();
    }
}

fn run(
    propagators: &Arc<Propagators>,
    job: Job,
    settings: RunSettings,
    cancel: &Cancel,
) -> Outcome {
    let mut start = match job.start {
        Some(start) => start,
        None => job.scene.sliding_equilibrium()?,
    };
    for (values, added) in
        [(&mut start.position, &job.added_position), (&mut start.velocity, &job.added_velocity)]
    {
        values.iter_mut().zip(added).for_each(|(value, added)| *value += added);
    }
    let controls = Controls { cancel: Some(cancel), ..settings.controls };
    let mut trajectory =
        simulate(propagators, &start, settings.duration, settings.method, controls)?;
    // What runs that share propagators find there depends on which of them came first.
    trajectory.counters.combinations = trajectory.combinations_met();
    Ok((start, trajectory))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::linalg::SparseMatrix;
    use crate::scene::{ContactInput, Damping, Direction, Mass, SceneInput};

    /// A mass carried by a belt, pressed on it by `load`.
    pub fn oscillator(load: f64) -> Arc<Scene> {
        let input = SceneInput {
            mass: Mass::Lumped(vec![1.5, 1.5]),
            stiffness: SparseMatrix::diagonal(&[3e4, 5e4]),
            damping: Damping::Proportional { mass: 0.0, stiffness: 1e-5 },
            gyroscopic: None,
            circulatory: None,
            force: vec![0.0, -load],
            contacts: vec![ContactInput {
                tangential: Some(Direction::Dof(0)),
                normal: Some(Direction::Dof(1)),
                friction: 0.5,
                static_friction: 0.7,
                slider_speed: 0.1,
                ..Default::default()
            }],
            impact_friction: false,
            loads: Default::default(),
        };
        Arc::new(Scene::new(input).expect("well-posed"))
    }

    fn batch() -> Batch {
        let settings =
            RunSettings { duration: 0.1, method: Method::Auto, controls: Controls::default() };
        Batch::new(settings, Some(2)).expect("two threads")
    }

    /// Faster than the belt: the mass turns back and is caught.
    pub fn job(scene: &Arc<Scene>) -> Job {
        let start = State {
            friction_force: Vec::new(),
            internal: Vec::new(),
            velocity: vec![0.3, 0.0],
            combination: crate::Combination::parse("-", 1).expect("one letter"),
            ..scene.sliding_equilibrium().expect("pressed on")
        };
        Job { start: Some(start), ..job_of(scene) }
    }

    fn job_of(scene: &Arc<Scene>) -> Job {
        Job {
            scene: Arc::clone(scene),
            start: None,
            added_position: Vec::new(),
            added_velocity: Vec::new(),
        }
    }

    fn collected(batch: &mut Batch) -> Vec<Outcome> {
        let mut outcomes = Vec::new();
        while batch.pending() > 0 {
            outcomes.extend(batch.collect(Duration::from_secs(1)));
        }
        outcomes
    }

    #[test]
    fn outcomes_come_in_the_order_of_the_jobs() {
        let scenes: Vec<_> = (0..40).map(|k| oscillator(20.0 + k as f64)).collect();
        let mut batch = batch();
        scenes.iter().for_each(|scene| batch.submit(job(scene)));
        for (scene, outcome) in scenes.iter().zip(collected(&mut batch)) {
            let (_, run) = outcome.expect("a run");
            assert!(Arc::ptr_eq(run.scene(), scene));
        }
    }

    /// A scene that no input makes: its contact lies outside its coordinates, so that every run panics.
    pub fn defective() -> Arc<Scene> {
        let mut scene = Arc::try_unwrap(oscillator(20.0)).expect("not shared");
        scene.contacts[0].normal = 99;
        Arc::new(scene)
    }

    #[test]
    fn a_panic_is_the_failure_of_its_own_run() {
        let (sound, broken) = (oscillator(20.0), defective());
        let start = job(&sound).start;
        let mut batch = batch();
        for scene in [&sound, &broken, &sound] {
            batch.submit(Job { start: start.clone(), ..job_of(scene) });
        }
        let outcomes = collected(&mut batch);
        assert!(outcomes[0].is_ok() && outcomes[2].is_ok());
        let Err(RunFailure::Internal(message)) = &outcomes[1] else { panic!("not a failure") };
        assert!(message.contains("99"), "{message}");
    }
    #[test]
    fn a_run_that_sends_nothing_has_failed() {
        let mut batch = batch();
        batch.pending.push_back(sync_channel(1).1);
        let outcome = batch.collect(Duration::from_secs(1)).expect("an outcome");
        assert!(matches!(outcome, Err(RunFailure::Internal(_))));
        assert_eq!(batch.pending(), 0);
    }
}
