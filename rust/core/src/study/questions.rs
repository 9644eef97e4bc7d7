//! What a study asks of every sample: stability, Hopf points, and what the motion settles to.
//!
//! The answers to one sample depend on its own scene alone, whatever runs beside it and in whatever order. A sample
//! that cannot be answered says why, and keeps what could be.

use std::sync::Arc;
use std::sync::atomic::AtomicUsize;

use num_complex::Complex64;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::cycles::attractors::attractor::Attractor;
use crate::cycles::attractors::attractor::settled_from;
use crate::cycles::attractors::lyapunov::Lyapunov;
use crate::cycles::attractors::search::Search;
use crate::cycles::orbits::cycle::{Cycle, Stability};
use crate::energy::work::Works;
use crate::energy::work::works;
use crate::error::{Cancel, Error, RunFailure};
use crate::locus::critical::hopf::first_hopf_point;
use crate::locus::parameter_path::Path;
use crate::locus::watched_path::WatchedPath;
use crate::modes::complex_modes::Modes;
use crate::modes::growth::{ChainMatrices, Growth};
use crate::motion::method::Method;
use crate::motion::propagators::Propagators;
use crate::scene::model::{Scene, State};
use crate::scene::status::Combination;
use crate::study::family::{Family, Template};
use crate::transient::run_state::Controls;
use crate::transient::simulate::simulate;
use crate::transient::trajectory::{StopReason, Trajectory};

/// Part of the slider speed at which the fastest growing mode starts.
const DISTURBANCE: f64 = 0.5;
/// Size of the start, m/s, where no contact moves in that mode.
const START_SPEED: f64 = 1e-3;

/// What is asked of every sample.
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

/// What is asked of the motion of every sample.
#[derive(Debug, Clone)]
pub struct MotionQuestions {
    /// s
    pub duration: f64,
    /// How much longer to follow a motion that has not settled, s.
    pub further: f64,
    /// How phases are propagated.
    pub method: Method,
    /// Number of events after which the motion stops; None: no limit.
    pub max_events: Option<usize>,
    /// Added to the sliding equilibrium, over dofs; None: its fastest growing mode, see [`disturbed_sliding`].
    pub added: Option<(Vec<f64>, Vec<f64>)>,
    /// Whether to look for what it settles to.
    pub settle: bool,
    /// Whether to integrate the works over a cycle.
    pub energy: bool,
    /// Whether the motion is handed out.
    pub keep: bool,
}

/// What kept a question from being answered.
#[derive(Debug, Clone, PartialEq)]
pub enum FailureKind {
    /// The sample is no scene, or does not fit the question.
    IllPosed,
    /// There is no steady sliding.
    NoEquilibrium,
    /// Eigenvalues that did not converge.
    Eigenvalues,
    /// The motion ended before the time asked for.
    Stopped(Box<StopReason>),
    /// What the motion settles to could not be found.
    Unsettled,
    /// A defect of the program.
    Error,
}

impl FailureKind {
    /// As columns of answers have it; of a motion the name of its [`StopReason`].
    pub const fn name(&self) -> &'static str {
        match self {
            FailureKind::IllPosed => "ill_posed",
            FailureKind::NoEquilibrium => "no_equilibrium",
            FailureKind::Eigenvalues => "eigenvalues",
            FailureKind::Stopped(reason) => reason.name(),
            FailureKind::Unsettled => "failed",
            FailureKind::Error => "error",
        }
    }
}

/// Why a question was not answered.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    /// What kind of failure it is.
    pub kind: FailureKind,
    /// In words.
    pub reason: String,
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let kind = match error {
            Error::NoSlidingDirection { .. }
            | Error::NoSteadySliding { .. }
            | Error::TensileEquilibrium { .. }
            | Error::SingularStiffness { .. } => FailureKind::NoEquilibrium,
            Error::Eigenvalues { .. } => FailureKind::Eigenvalues,
            _ => FailureKind::IllPosed,
        };
        Self { kind, reason: error.to_string() }
    }
}

/// The answers to one sample; what was not asked or could not be answered is absent.
#[derive(Debug, Default)]
pub struct Answer {
    /// The least stable eigenvalue.
    pub growth: Option<Growth>,
    /// All eigenvalues, 1/s, sorted by modulus, conjugates adjacent.
    pub eigenvalues: Vec<Complex64>,
    /// Of every contact at the sliding equilibrium, N.
    pub normal_force: Vec<f64>,
    /// Lowest parameter at which a mode becomes unstable, and its |lambda| in 1/s; NaN where there is none.
    pub hopf: Option<(f64, f64)>,
    /// What the motion does.
    pub motion: Option<MotionAnswer>,
    /// The start of the motion and the motion, where it is to be kept.
    pub run: Option<(State, Trajectory)>,
    /// The first of them.
    pub failure: Option<Failure>,
}

/// What a computed motion does.
#[derive(Debug)]
pub struct MotionAnswer {
    /// Events within the duration asked for.
    pub events: usize,
    /// What it settles to, where that was asked for and found.
    pub settled: Option<Settled>,
}

/// The kinds of what motions settle to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SettledKind {
    /// Rest or steady sliding.
    Equilibrium,
    /// A periodic orbit.
    Cycle,
    /// Neither within the motion looked at.
    Aperiodic,
}

impl SettledKind {
    /// As columns of answers have it.
    pub const fn name(self) -> &'static str {
        match self {
            SettledKind::Equilibrium => "equilibrium",
            SettledKind::Cycle => "cycle",
            SettledKind::Aperiodic => "aperiodic",
        }
    }
}

/// What a motion has settled to.
#[derive(Debug)]
pub struct Settled {
    /// Rest, cycle or aperiodic motion.
    pub kind: SettledKind,
    /// Of an aperiodic motion.
    pub growth: Option<Lyapunov>,
    /// Combinations in order of one period, or of the last stretch, without repetition of neighbours.
    pub sequence: Vec<Combination>,
    /// Half the range of every displacement, m; zero at rest, empty where aperiodic.
    pub amplitude: Vec<f64>,
    /// s
    pub period: f64,
    /// Largest modulus of the multipliers but the one of the phase.
    pub multiplier: f64,
    /// Of a cycle.
    pub stability: Option<Stability>,
    /// Works of one period of a cycle, where asked for.
    pub energy: Option<CycleEnergy>,
}

/// Works of one period, J.
#[derive(Debug, Clone, PartialEq)]
pub struct CycleEnergy {
    /// Through each contact into the structure, impacts included.
    pub contact: Vec<f64>,
    /// Of the slider of each contact, impacts included.
    pub slider: Vec<f64>,
    /// Dissipated by dampers and, in the normal direction, by impacts.
    pub dissipated: f64,
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

/// What a thread reuses from sample to sample.
struct Workspace {
    template: Option<Template>,
    matrices: ChainMatrices,
}

/// The answers to all samples, in their order, on all threads of the pool in use; `cancel` cuts it short.
pub fn answers(samples: &Samples<'_>, questions: &Questions, cancel: &Cancel) -> Vec<Answer> {
    let workspace = || Workspace {
        template: match samples {
            Samples::Family(family, _) => Some(family.template()),
            Samples::Scenes(_) => None,
        },
        matrices: ChainMatrices::default(),
    };
    // A verdict takes microseconds, a motion milliseconds: one of them outweighs handing the work over.
    let least = if questions.motion.is_some() || questions.hopf.is_some() { 1 } else { 64 };
    (0..samples.len())
        .into_par_iter()
        .with_min_len(least)
        .map_init(workspace, |workspace, k| {
            let mut answer = Answer::default();
            if cancel.is_requested() {
                return answer;
            }
            let asked = RunFailure::guarded(|| match samples {
                Samples::Family(family, rows) => {
                    let width = family.width();
                    let row = &rows[k * width..(k + 1) * width];
                    ask_family(family, row, questions, cancel, workspace, &mut answer);
                }
                Samples::Scenes(scenes) => ask(&scenes[k], questions, cancel, &mut answer),
            });
            if let Err(failure) = asked {
                answer.fail(Failure { kind: FailureKind::Error, reason: failure.to_string() });
            }
            answer
        })
        .collect()
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
    family: &Family,
    row: &[f64],
    questions: &Questions,
    cancel: &Cancel,
    workspace: &mut Workspace,
    answer: &mut Answer,
) {
    let template = workspace.template.get_or_insert_with(|| family.template());
    family.fill(template, row);
    if let Template::Chain(chain) = &*template
        && questions.growth
        && questions.combination.is_none()
        && chain.is_well_posed()
        && let Some(statuses) = chain.sliding_statuses()
    {
        let (growth, normal_forces) = chain.growth(&statuses, &mut workspace.matrices);
        if growth.eigenvalue.re.is_nan() {
            let combination = Combination::new(statuses);
            answer.fail(Error::Eigenvalues {
                combination: combination.to_string(),
                residual: f64::NAN,
            });
        } else if !normal_forces.iter().any(|&normal_force| normal_force < 0.0) {
            answer.growth = Some(growth);
        }
        // Where a contact would pull, the scene says so.
        let answered = answer.growth.is_some() || answer.failure.is_some();
        if answered && !questions.needs_scene() {
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
    let wanted = questions.growth && answer.growth.is_none() && answer.failure.is_none();
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
        match hopf_point(scene, questions.combination.as_ref(), range) {
            Ok(point) => answer.hopf = Some(point),
            Err(error) => answer.fail(error),
        }
    }
    if let Some(motion) = &questions.motion {
        let propagators = Arc::new(Propagators::new(Arc::clone(scene)));
        if let Err(failure) = move_on(&propagators, motion, cancel, answer) {
            answer.fail(failure);
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

/// Of steady sliding, unless a combination is given, only points at which it exists.
fn hopf_point(
    scene: &Scene,
    combination: Option<&Combination>,
    range: &HopfRange,
) -> Result<(f64, f64), Failure> {
    let HopfRange { contacts, lower, upper } = range;
    let chosen = combination.map_or_else(|| scene.sliding_combination(), |c| Ok(c.clone()))?;
    let path = Path::contact_law([scene, scene], &chosen, contacts, *lower, *upper)?;
    let mut lost = None;
    let eigenproblems = AtomicUsize::new(0);
    let watched = WatchedPath { path: &path, cancel: None, eigenproblems: &eigenproblems };
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

fn move_on(
    propagators: &Arc<Propagators>,
    questions: &MotionQuestions,
    cancel: &Cancel,
    answer: &mut Answer,
) -> Result<(), Failure> {
    let scene = &propagators.scene;
    let start = match &questions.added {
        None => disturbed_sliding(scene)?,
        Some((position, velocity)) => {
            let mut start = scene.sliding_equilibrium()?;
            start.position.iter_mut().zip(position).for_each(|(x, added)| *x += added);
            start.velocity.iter_mut().zip(velocity).for_each(|(v, added)| *v += added);
            start
        }
    };
    let controls =
        Controls { max_events: questions.max_events, cancel: Some(cancel), ..Controls::default() };
    let run = simulate(propagators, &start, questions.duration, questions.method, controls)?;
    let mut motion = MotionAnswer { events: run.events.len(), settled: None };
    let ended = stop_failure(&run.stop_reason);
    let mut failed = ended.clone();
    if questions.settle && ended.is_none() {
        match settled(&run, questions, cancel) {
            Ok(settled) => motion.settled = Some(settled),
            Err(failure) => failed = Some(failure),
        }
    }
    answer.motion = Some(motion);
    if questions.keep {
        answer.run = Some((start, run));
    }
    failed.map_or(Ok(()), Err)
}

fn stop_failure(reason: &StopReason) -> Option<Failure> {
    let reason_in_words = match reason {
        StopReason::Duration | StopReason::TimeLimit | StopReason::Grazing => return None,
        StopReason::MaxEvents => "more events than max_events".to_owned(),
        StopReason::Unbounded => "the motion grows without bound".to_owned(),
        StopReason::Interrupted | StopReason::Chattering { .. } | StopReason::Failed(_) => {
            reason.to_string()
        }
    };
    Some(Failure { kind: FailureKind::Stopped(Box::new(reason.clone())), reason: reason_in_words })
}

fn settled(
    run: &Trajectory,
    questions: &MotionQuestions,
    cancel: &Cancel,
) -> Result<Settled, Failure> {
    let search = Search {
        stretch: questions.duration,
        limit: questions.further,
        method: questions.method,
        cancel: Some(cancel),
        deadline: None,
    };
    let (attractor, later) = settled_from(run, search)?;
    let last = later.as_ref().unwrap_or(run);
    let mut settled = Settled {
        kind: SettledKind::Cycle,
        growth: None,
        sequence: Vec::new(),
        amplitude: Vec::new(),
        period: f64::NAN,
        multiplier: f64::NAN,
        stability: None,
        energy: None,
    };
    match attractor {
        Attractor::Cycle(found) => {
            let cycle = &found.cycle;
            settled.period = cycle.orbit.period;
            let steps = cycle.orbit.steps.iter().filter(|step| step.duration > 0.0);
            settled.sequence = steps.map(|step| step.combination.clone()).collect();
            let extremes = &cycle.extremes;
            let ranges = extremes.maximum.iter().zip(&extremes.minimum);
            settled.amplitude = ranges.map(|(high, low)| 0.5 * (high - low)).collect();
            settled.multiplier = cycle.multipliers.largest();
            settled.stability = Some(cycle.stability);
            if questions.energy {
                settled.energy = Some(cycle_energy(cycle)?);
            }
        }
        Attractor::Equilibrium => {
            settled.kind = SettledKind::Equilibrium;
            settled.sequence = last.combinations_in_order().pop().into_iter().collect();
            settled.amplitude = vec![0.0; last.scene().size];
        }
        Attractor::Aperiodic(growth) => {
            settled.kind = SettledKind::Aperiodic;
            settled.growth = Some(growth);
            settled.sequence = last.combinations_in_order();
        }
        Attractor::Unbounded | Attractor::Stopped => {
            return Err(stop_failure(&last.stop_reason).unwrap_or(Failure {
                kind: FailureKind::Unsettled,
                reason: "the run could not go on".to_owned(),
            }));
        }
    }
    Ok(settled)
}

fn cycle_energy(cycle: &Cycle) -> Result<CycleEnergy, Error> {
    let run = cycle.orbit.trajectory()?;
    let Works { phases, impacts, .. } = works(&run, 0.0, run.end)?;
    let contacts = run.scene().contacts.len();
    let mut energy = CycleEnergy {
        contact: vec![0.0; contacts],
        slider: vec![0.0; contacts],
        dissipated: phases.iter().flat_map(|phase| &phase.damping).sum(),
    };
    for phase in &phases {
        for contact in 0..contacts {
            energy.contact[contact] += phase.contact[contact];
            energy.slider[contact] += phase.slider[contact];
        }
    }
    for impact in &impacts {
        energy.contact[impact.contact] += impact.slider - impact.friction;
        energy.slider[impact.contact] += impact.slider;
        energy.dissipated += impact.normal;
    }
    Ok(energy)
}

/// Steady sliding with its fastest growing mode set in motion: by velocity alone, the tangential velocity of no
/// contact above half of its slider speed, so that every contact goes on sliding.
pub fn disturbed_sliding(scene: &Scene) -> Result<State, Error> {
    let mut start = scene.sliding_equilibrium()?;
    let modes = Modes::new(scene, &start.combination)?;
    let mut fastest = 0;
    for (k, lambda) in modes.eigenvalues.iter().enumerate() {
        if lambda.re > modes.eigenvalues[fastest].re {
            fastest = k;
        }
    }
    let shape: Vec<f64> = modes.shapes[scene.size * fastest..scene.size * (fastest + 1)]
        .iter()
        .map(|entry| entry.re)
        .collect();
    let moved = scene.coordinates.of_dofs(&shape);
    let largest = scene
        .contacts
        .iter()
        .map(|law| (moved[law.tangential] / law.slider_speed).abs())
        .fold(0.0, f64::max);
    let scale = if largest > 0.0 { DISTURBANCE / largest } else { START_SPEED };
    start.velocity = shape.into_iter().map(|entry| scale * entry).collect();
    Ok(start)
}

/// N of every contact at rest in an equilibrium.
fn normal_forces_at_rest(scene: &Scene, state: &State) -> Vec<f64> {
    let (q, _) = scene.to_coordinates(&state.position, &state.velocity);
    let row = |law: &crate::scene::contact_law::Contact| {
        scene.stiffness.row_dot(law.normal, &q) - scene.force[law.normal]
    };
    scene.contacts.iter().map(row).collect()
}
