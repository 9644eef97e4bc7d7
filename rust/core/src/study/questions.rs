//! The questions of a study to every sample: stability, Hopf points, and the attractor of the motion.
//!
//! The answers to one sample depend on its own scene alone, whatever runs beside it and in whatever order. If a question
//! has no answer, the sample says why, and keeps the other answers.

use std::sync::Arc;
use std::sync::atomic::AtomicUsize;

use num_complex::Complex64;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::contact::contact_forces::contact_forces_in;
use crate::error::cancel::Cancel;
use crate::error::run::RunFailure;
use crate::linalg::parallel::in_parallel;
use crate::locus::critical::hopf::first_hopf_point;
use crate::locus::parameter_path::Path;
use crate::locus::watched_path::WatchedPath;
use crate::modes::complex_modes::Modes;
use crate::modes::growth::{ChainMatrices, Growth, Verdict};
use crate::motion::propagators::Propagators;
use crate::scene::model::{Scene, State};
use crate::scene::status::Combination;
use crate::study::failure::{Failure, FailureKind};
use crate::study::family::{Family, Template};
use crate::study::motions::{Followed, MotionAnswer, MotionQuestions, follow};
use crate::transient::trajectory::model::Trajectory;

/// The questions to every sample.
#[derive(Debug, Clone)]
pub struct Questions {
    /// Status combination for everything about stability; None: that of steady sliding, where it exists.
    pub combination: Option<Combination>,
    /// Whether to compute the least stable eigenvalue.
    pub growth: bool,
    /// Whether to hand out all eigenvalues.
    pub eigenvalues: bool,
    /// Whether to compute the normal forces at the sliding equilibrium.
    pub normal_force: bool,
    /// Where to look for a Hopf point; None: nowhere.
    pub hopf: Option<HopfRange>,
    /// What to ask of the motion; None: it is not computed.
    pub motion: Option<MotionQuestions>,
}

/// The friction that is moved for a Hopf point.
#[derive(Debug, Clone)]
pub struct HopfRange {
    /// Indices of the contacts whose friction is moved.
    pub contacts: Vec<usize>,
    /// Lower end of the search, -.
    pub lower: f64,
    /// Upper end of the search, -.
    pub upper: f64,
}

/// The answers to one sample; what was not asked or could not be answered is absent.
#[derive(Debug, Default)]
pub struct Answer {
    /// The least stable eigenvalue.
    pub growth: Option<Growth>,
    /// All eigenvalues, 1/s, sorted by modulus, conjugates adjacent.
    pub eigenvalues: Vec<Complex64>,
    /// Normal force of every contact at the sliding equilibrium, N.
    pub normal_force: Vec<f64>,
    /// Lowest parameter at which a mode becomes unstable, and its |lambda| in 1/s; NaN where there is none.
    pub hopf: Option<(f64, f64)>,
    /// The answers of the motion.
    pub motion: Option<MotionAnswer>,
    /// The start of the motion and the motion, where it is to be kept.
    pub run: Option<(State, Trajectory)>,
    /// The first reason why a question has no answer.
    pub failure: Option<Failure>,
}

/// Where the samples come from.
#[derive(Debug, Clone)]
pub enum Samples<'a> {
    /// One row of `width` numbers per sample.
    Family(&'a Family, &'a [f64]),
    /// One scene per sample.
    Scenes(&'a [Arc<Scene>]),
}

impl Samples<'_> {
    pub(crate) fn len(&self) -> usize {
        match self {
            Samples::Family(family, rows) => rows.len() / family.width().max(1),
            Samples::Scenes(scenes) => scenes.len(),
        }
    }
}

/// Data that a thread reuses from sample to sample.
#[derive(Default)]
pub(crate) struct Workspace {
    template: Option<Template>,
    matrices: ChainMatrices,
}

impl Workspace {
    /// The template of a family with the numbers of sample k, and the matrices of chains.
    pub fn filled(
        &mut self,
        family: &Family,
        rows: &[f64],
        k: usize,
    ) -> (&Template, &mut ChainMatrices) {
        let template = self.template.get_or_insert_with(|| family.template());
        let width = family.width();
        family.fill(template, &rows[k * width..(k + 1) * width]);
        (template, &mut self.matrices)
    }
}

/// The answers to all samples, in their order, on all threads of the pool in use; `cancel` cuts it short.
pub fn answers(samples: &Samples<'_>, questions: &Questions, cancel: &Cancel) -> Vec<Answer> {
    // A verdict takes microseconds, a motion milliseconds: one of them outweighs handing the work over.
    let least = if questions.motion.is_some() || questions.hopf.is_some() { 1 } else { 64 };
    let one = |workspace: &mut Workspace, k: usize| {
        let mut answer = Answer::default();
        if cancel.is_requested() {
            return answer;
        }
        let asked = RunFailure::guarded(|| match samples {
            Samples::Family(family, rows) => {
                ask_family(workspace.filled(family, rows, k), questions, cancel, &mut answer);
            }
            Samples::Scenes(scenes) => ask(&scenes[k], questions, cancel, &mut answer),
        });
        if let Err(failure) = asked {
            answer.fail(Failure { kind: FailureKind::Error, reason: failure.to_string() });
        }
        answer
    };
    let numbers = (0..samples.len()).into_par_iter().with_min_len(least);
    in_parallel(|| numbers.map_init(Workspace::default, one).collect())
}

/// A pool of `threads` threads, to install [`answers`] in.
pub fn pool(threads: usize) -> Result<ThreadPool, String> {
    let built = ThreadPoolBuilder::new().num_threads(threads).build();
    built.map_err(|error| format!("threads: {error}"))
}

impl Answer {
    fn fail(&mut self, failure: impl Into<Failure>) {
        self.failure.get_or_insert(failure.into());
    }
}

fn ask_family(
    (template, matrices): (&Template, &mut ChainMatrices),
    questions: &Questions,
    cancel: &Cancel,
    answer: &mut Answer,
) {
    // Where a contact would pull, or an eigenvalue is not found, the scene says so.
    if questions.growth
        && questions.combination.is_none()
        && let Template::Chain(chain) = template
        && let Some(Verdict { growth, steady }) = chain.verdict(None, matrices)
        && !growth.eigenvalue.re.is_nan()
        && !steady.margins.iter().any(|&normal_force| normal_force < 0.0)
    {
        answer.growth = Some(growth);
        if !questions.needs_scene() {
            return;
        }
    }
    match template.scene() {
        Ok(scene) => ask(&scene, questions, cancel, answer),
        Err(error) => answer.fail(error),
    }
}

impl Questions {
    /// Whether something besides the verdict on stability is asked.
    fn needs_scene(&self) -> bool {
        self.eigenvalues || self.normal_force || self.hopf.is_some() || self.motion.is_some()
    }
}

fn ask(scene: &Arc<Scene>, questions: &Questions, cancel: &Cancel, answer: &mut Answer) {
    let wanted = questions.growth && answer.growth.is_none();
    if wanted || questions.eigenvalues {
        match questions.combination.clone().map_or_else(|| scene.steady_sliding(), Ok) {
            Ok(combination) => spectrum(scene, &combination, wanted, questions.eigenvalues, answer),
            Err(error) => answer.fail(error),
        }
    }
    if questions.normal_force {
        match scene.sliding_equilibrium() {
            Ok(state) => answer.normal_force = normal_forces_at_rest(scene, &state),
            Err(error) => answer.fail(error),
        }
    }
    if let Some(range) = &questions.hopf {
        match hopf_point(scene, questions.combination.as_ref(), range, cancel) {
            Ok(point) => answer.hopf = Some(point),
            Err(error) => answer.fail(error),
        }
    }
    if let Some(motion) = &questions.motion {
        let propagators = Arc::new(Propagators::new(Arc::clone(scene)));
        match follow(&propagators, motion, cancel) {
            Ok(Followed { start, run, settled, failure }) => {
                answer.motion = Some(MotionAnswer { events: run.events.len(), settled });
                answer.run = motion.keep.then_some((start, run));
                failure.into_iter().for_each(|failure| answer.fail(failure));
            }
            Err(failure) => answer.fail(failure),
        }
    }
}

fn spectrum(
    scene: &Scene,
    combination: &Combination,
    growth: bool,
    eigenvalues: bool,
    answer: &mut Answer,
) {
    if growth {
        match Growth::of_scene(scene, combination) {
            Ok(growth) => answer.growth = Some(growth),
            Err(error) => answer.fail(error),
        }
    }
    if eigenvalues {
        match Modes::new(scene, combination) {
            Ok(modes) => answer.eigenvalues = modes.eigenvalues,
            Err(error) => answer.fail(error),
        }
    }
}

/// The first Hopf point; without a given combination, only points at which steady sliding exists.
fn hopf_point(
    scene: &Scene,
    combination: Option<&Combination>,
    range: &HopfRange,
    cancel: &Cancel,
) -> Result<(f64, f64), Failure> {
    let HopfRange { contacts, lower, upper } = range;
    let chosen = combination.map_or_else(|| scene.sliding_combination(), |c| Ok(c.clone()))?;
    let path = Path::contact_law([scene, scene], &chosen, contacts, *lower, *upper)?;
    let mut lost = None;
    let eigenproblems = AtomicUsize::new(0);
    let watched = WatchedPath { path: &path, cancel: Some(cancel), eigenproblems: &eigenproblems };
    let first = first_hopf_point(watched, |point| {
        let destabilising = point.slope > 0.0;
        if destabilising {
            lost.get_or_insert(point.value);
        }
        destabilising && (combination.is_some() || path.steady_at(point.value).exists)
    })?;
    let first = first.map(|point| (point.value, point.eigenvalue.norm()));
    match (first, lost) {
        (None, Some(value)) => Err(Failure {
            kind: FailureKind::NoEquilibrium,
            reason: format!("hopf_point: at friction {value} there is no steady sliding"),
        }),
        _ => Ok(first.unwrap_or((f64::NAN, f64::NAN))),
    }
}

/// N of every contact at rest in an equilibrium.
fn normal_forces_at_rest(scene: &Scene, state: &State) -> Vec<f64> {
    let (q, _) = scene.to_coordinates(&state.position, &state.velocity);
    let still = vec![0.0; q.len()];
    let forces = contact_forces_in(scene, &state.combination, &q, &still);
    forces.into_iter().map(|(normal, _)| normal).collect()
}
