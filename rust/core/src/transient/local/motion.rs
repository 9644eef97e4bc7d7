//! The motion of a local march: the state at the start of every panel, and the values that each event has set.
//!
//! All other states are restored to the last bit by expanding the same series again.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};

use crate::motion::local::field::{Field, Reset};
use crate::motion::local::reach::Reaches;
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};
use crate::transient::clock::Clock;
use crate::transient::trajectory::kept_states::{KEPT, KeptStates};

/// A panel of all coordinates.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct PanelStart {
    pub clock: Clock,
    /// s after its start.
    pub end: f64,
    /// Steps taken before it begins, which follow from those.
    #[serde(skip)]
    pub steps: usize,
}

/// The values that the events of one instant have set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct MarchStep {
    /// Its panel, and s after the start of that.
    pub panel: usize,
    pub at: f64,
    /// Whether the panel begins with it, so that nothing is restarted.
    pub begins: bool,
    /// The contacts that it restarts, with their statuses from then on.
    pub statuses: Vec<(usize, Status)>,
    pub resets: Vec<Reset>,
}

/// The panels of a motion and the steps in them; phase k begins with step k - 1.
#[derive(Debug)]
pub(crate) struct LocalMotion {
    scene: Arc<Scene>,
    locality: Arc<Reaches>,
    start: Vec<Status>,
    /// Time of the loads at the start, s.
    pub load_time: f64,
    pub panels: Vec<PanelStart>,
    pub states: KeptStates,
    pub steps: Vec<MarchStep>,
    /// Number of steps and the statuses after them, from the last time that statuses were asked for.
    passed: Mutex<(usize, Vec<Status>)>,
    /// The panel from the last time that the motion was asked for.
    replay: Mutex<Option<Replay>>,
}

/// A panel expanded again, up to some step.
#[derive(Debug)]
struct Replay {
    field: Field,
    statuses: Vec<Status>,
    panel: usize,
    steps: usize,
}

impl LocalMotion {
    pub fn new(
        scene: &Arc<Scene>,
        locality: &Arc<Reaches>,
        start: &Combination,
        (load_time, kept): (f64, Option<usize>),
    ) -> Self {
        let kept = kept.unwrap_or(KEPT);
        Self {
            scene: Arc::clone(scene),
            locality: Arc::clone(locality),
            start: start.statuses().to_vec(),
            load_time,
            panels: Vec::new(),
            states: KeptStates::new(scene.size, 0, kept),
            steps: Vec::new(),
            passed: Mutex::default(),
            replay: Mutex::default(),
        }
    }

    /// A bound of the growth of the state, 1/s.
    pub fn growth_rate(&self) -> f64 {
        self.locality.sigma
    }

    /// The statuses at the start.
    pub fn start(&self) -> Combination {
        Combination::new(self.start.clone())
    }

    /// The statuses after some steps.
    pub fn combination(&self, steps: usize) -> Combination {
        let mut kept = self.passed.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.0 > steps || kept.1.is_empty() {
            *kept = (0, self.start.clone());
        }
        let (from, statuses) = &mut *kept;
        set(statuses, &self.steps[*from..steps]);
        *from = steps;
        Combination::new(statuses.clone())
    }

    /// (q, q') in a phase, at a time after its start.
    pub fn state(&self, phase: usize, local: f64, q: &mut [f64], u: &mut [f64]) {
        let (panel, at) = self.place(phase, local);
        let mut kept = self.replay();
        let replay = kept.get_or_insert_with(|| Replay::new(self));
        replay.go(self, panel, phase);
        replay.field.values(at, q, u);
    }

    /// The panel of a time after the start of a phase, and the time after the start of that.
    fn place(&self, phase: usize, local: f64) -> (usize, f64) {
        let (first, at) = match phase.checked_sub(1).map(|step| &self.steps[step]) {
            None => (0, 0.0),
            Some(step) => (step.panel, step.at),
        };
        // The end of a phase belongs to the panel before the one that its event begins.
        let last = match self.steps.get(phase) {
            None => self.panels.len() - 1,
            Some(next) => next.panel - usize::from(next.begins),
        };
        let since = |panel: usize| {
            let (from, to) = (&self.panels[first].clock, &self.panels[panel].clock);
            (to.seconds - from.seconds) + (to.rest - from.rest)
        };
        let time = at + local;
        let (mut panel, mut beyond) = (first, last + 1);
        while panel + 1 < beyond {
            let middle = panel.midpoint(beyond);
            if since(middle) <= time { panel = middle } else { beyond = middle }
        }
        (panel, (time - since(panel)).clamp(0.0, self.panels[panel].end))
    }

    /// The states at the starts of some panels, once more.
    fn again(&self, first: usize, count: usize) -> Vec<f64> {
        let n = self.scene.size;
        let mut replay = Replay::new(self);
        let mut states = Vec::with_capacity(2 * n * count);
        let (mut q, mut u) = (vec![0.0; n], vec![0.0; n]);
        for panel in first..first + count {
            if panel == first {
                replay.begin(self, panel);
                replay.field.values(0.0, &mut q, &mut u);
            } else {
                let next = &self.panels[panel];
                let begun = self.steps[..next.steps].iter().rev();
                let begun = begun.take_while(|step| step.begins && step.panel == panel).count();
                replay.take(self, next.steps - begun);
                replay.field.values(self.panels[panel - 1].end, &mut q, &mut u);
                let steps = &self.steps[next.steps - begun..next.steps];
                set(&mut replay.statuses, steps);
                for reset in steps.iter().flat_map(|step| &step.resets) {
                    (q[reset.coordinate], u[reset.coordinate]) = (reset.q, reset.u);
                }
                replay.field.begin(&replay.statuses, &q, &u);
                (replay.panel, replay.steps) = (panel, next.steps);
            }
            states.extend_from_slice(&q);
            states.extend_from_slice(&u);
        }
        states
    }

    fn replay(&self) -> MutexGuard<'_, Option<Replay>> {
        self.replay.lock().unwrap_or_else(|poisoned| {
            // What panicked may have left a panel half expanded.
            let mut kept = PoisonError::into_inner(poisoned);
            *kept = None;
            kept
        })
    }
}

fn set(statuses: &mut [Status], steps: &[MarchStep]) {
    for &(contact, status) in steps.iter().flat_map(|step| &step.statuses) {
        statuses[contact] = status;
    }
}

impl Replay {
    fn new(motion: &LocalMotion) -> Self {
        let field = Field::new(&motion.scene, &motion.locality);
        Self { field, statuses: Vec::new(), panel: usize::MAX, steps: usize::MAX }
    }

    /// Expands a panel up to a step, on from where it is.
    fn go(&mut self, motion: &LocalMotion, panel: usize, steps: usize) {
        if self.panel != panel || self.steps > steps {
            self.begin(motion, panel);
        }
        // Between two steps with which a panel begins no time passes.
        self.take(motion, steps.max(self.steps));
    }

    fn begin(&mut self, motion: &LocalMotion, panel: usize) {
        let steps = motion.panels[panel].steps;
        if self.steps > steps {
            self.statuses.clone_from(&motion.start);
            self.steps = 0;
        }
        set(&mut self.statuses, &motion.steps[self.steps..steps]);
        (self.panel, self.steps) = (panel, steps);
        let state = motion.states.state(panel, |first, count| motion.again(first, count));
        let (q, u) = state.parts();
        self.field.begin(&self.statuses, q, u);
    }

    fn take(&mut self, motion: &LocalMotion, steps: usize) {
        for step in &motion.steps[self.steps..steps] {
            set(&mut self.statuses, std::slice::from_ref(step));
            let contacts: Vec<usize> = step.statuses.iter().map(|entry| entry.0).collect();
            self.field.restart(&self.statuses, &contacts, &step.resets, step.at);
        }
        self.steps = steps;
    }
}
