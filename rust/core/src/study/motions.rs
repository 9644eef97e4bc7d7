//! The questions of a study about the motion of a sample, and the answers.

use std::sync::Arc;

use crate::cycles::attractors::attractor::{Attractor, settled_from};
use crate::cycles::attractors::lyapunov::Lyapunov;
use crate::cycles::attractors::search::SearchLimits;
use crate::cycles::orbits::cycle::{Cycle, Stability};
use crate::energy::work::{Works, works};
use crate::error::cancel::Cancel;
use crate::error::input::Error;
use crate::modes::complex_modes::Modes;
use crate::motion::method::Method;
use crate::motion::propagators::Propagators;
use crate::scene::model::{Scene, State};
use crate::scene::status::Combination;
use crate::study::failure::{Failure, FailureKind};
use crate::transient::run_state::Controls;
use crate::transient::simulate::simulate;
use crate::transient::trajectory::model::Trajectory;

/// Part of the slider speed at which the fastest growing mode starts.
const DISTURBANCE: f64 = 0.5;
/// Size of the start, m/s, if no contact moves in that mode.
const START_SPEED: f64 = 1e-3;

/// The questions about the motion of every sample.
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
    /// Added to the sliding equilibrium, over dofs; None: the velocity of its fastest growing mode, so small
    /// that every contact goes on sliding.
    pub added: Option<(Vec<f64>, Vec<f64>)>,
    /// Whether to look for what it settles to.
    pub settle: bool,
    /// Whether to integrate the works over a cycle.
    pub energy: bool,
    /// Whether the motion is handed out.
    pub keep: bool,
}

/// The answers of a computed motion.
#[derive(Debug)]
pub struct MotionAnswer {
    /// Events within the duration asked for.
    pub events: usize,
    /// The attractor, if it was asked for and found.
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

/// The attractor to which a motion has settled.
#[derive(Debug)]
pub struct Settled {
    /// Rest, cycle or aperiodic motion.
    pub kind: SettledKind,
    /// Growth rate of the neighbours of an aperiodic motion.
    pub growth: Option<Lyapunov>,
    /// Combinations in order of one period, or of the last stretch, without repetition of neighbours.
    pub sequence: Vec<Combination>,
    /// Half the range of every displacement, m; zero at rest, empty where aperiodic.
    pub amplitude: Vec<f64>,
    /// s
    pub period: f64,
    /// Largest modulus of the multipliers but the one of the phase.
    pub multiplier: f64,
    /// Stability of a cycle.
    pub stability: Option<Stability>,
    /// Works of one period of a cycle, where asked for.
    pub energy: Option<CycleEnergy>,
}

/// Works of one period, J.
#[derive(Debug, Clone, PartialEq)]
pub struct CycleEnergy {
    /// Work through each contact into the structure, impacts included.
    pub contact: Vec<f64>,
    /// Work of the slider of each contact, impacts included.
    pub slider: Vec<f64>,
    /// Energy dissipated by dampers and, in the normal direction, by impacts.
    pub dissipated: f64,
}

/// A motion that was followed for a study.
pub(crate) struct Followed {
    pub start: State,
    pub run: Trajectory,
    pub settled: Option<Settled>,
    /// Why it ended early, or settled to nothing that was found.
    pub failure: Option<Failure>,
}

/// Follows the motion of one sample.
pub(crate) fn follow(
    propagators: &Arc<Propagators>,
    questions: &MotionQuestions,
    cancel: &Cancel,
) -> Result<Followed, Failure> {
    let scene = propagators.bare();
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
    let failure = Failure::of_stop(&run.stop_reason);
    let (settled, failure) = match questions.settle && failure.is_none() {
        true => match settled(&run, questions, cancel) {
            Ok(settled) => (Some(settled), None),
            Err(failure) => (None, Some(failure)),
        },
        false => (None, failure),
    };
    Ok(Followed { start, run, settled, failure })
}

fn settled(
    run: &Trajectory,
    questions: &MotionQuestions,
    cancel: &Cancel,
) -> Result<Settled, Failure> {
    let search = SearchLimits {
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
            settled.amplitude = vec![0.0; last.scene().dofs];
        }
        Attractor::Aperiodic(growth) => {
            settled.kind = SettledKind::Aperiodic;
            settled.growth = Some(growth);
            settled.sequence = last.combinations_in_order();
        }
        Attractor::Unbounded | Attractor::Stopped => {
            return Err(Failure::of_stop(&last.stop_reason).unwrap_or(Failure {
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
fn disturbed_sliding(scene: &Scene) -> Result<State, Error> {
    let mut start = scene.sliding_equilibrium()?;
    let modes = Modes::new(scene, &start.combination)?;
    let mut fastest = 0;
    for (k, lambda) in modes.eigenvalues.iter().enumerate() {
        if lambda.re > modes.eigenvalues[fastest].re {
            fastest = k;
        }
    }
    let shape: Vec<f64> = modes.shapes[scene.dofs * fastest..scene.dofs * (fastest + 1)]
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
