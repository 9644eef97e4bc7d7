//! The motion of one phase. Every kind of motion answers the same question: which polynomial is each event function on
//! the next interval of time, and how large can its error be?

use std::sync::Arc;

use crate::contact::event_function::EventFunction;
use crate::error::run::LawEnd;
use crate::motion::combination_basis::{CombinationBasis, Propagator};
use crate::motion::friction::motion::LawMotion;
use crate::motion::friction::operator::LawOperator;
use crate::motion::friction::series::law_contact::LawOf;
use crate::motion::modal::basis::ModalBasis;
use crate::motion::modal::motion::ModalMotion;
use crate::motion::panel::Panel;
use crate::motion::taylor::motion::TaylorMotion;
use crate::motion::taylor::operator::TaylorOperator;
use crate::scene::model::Scene;

/// Why a phase under a law has its motion.
const BEGUN: &str = "restarting a phase under a law begins its motion";

/// Number of bases that a motion remembers.
const REMEMBERED: usize = 16;
/// Numbers that the bases at hand of a motion may hold in all: 32 MB, beside those that the propagators keep.
pub(crate) const HELD: usize = 1 << 22;

/// A phase in progress, with buffers that serve one phase after the other.
#[derive(Debug)]
pub(crate) struct Motion {
    scene: Arc<Scene>,
    /// The last ones met: a count of references that other threads share would cost each phase more than this search.
    bases: Vec<Arc<CombinationBasis>>,
    /// Place of the one in progress.
    current: usize,
    modal: ModalMotion,
    taylor: TaylorMotion,
    /// The motion of a combination in which friction depends on slip speed.
    law: Option<Box<LawMotion>>,
    /// The motions of the blocks of a scene.
    blocks: Vec<BlockMotion>,
}

#[derive(Debug)]
struct BlockMotion {
    motion: Motion,
    q: Vec<f64>,
    u: Vec<f64>,
}

/// A phase in progress of a scene in one block: events are searched for in each block by itself.
pub(crate) struct CoupledMotion<'a> {
    pub functions: &'a [EventFunction],
    basis: &'a CombinationBasis,
    scene: &'a Scene,
    kind: Kind<'a>,
}

enum Kind<'a> {
    Modal(&'a mut ModalMotion, &'a ModalBasis),
    Taylor(&'a mut TaylorMotion, &'a TaylorOperator),
    Law(&'a mut LawMotion, &'a LawOperator),
}

impl Motion {
    /// A phase of `basis` from (q, q') at local time 0.
    pub fn new(scene: &Arc<Scene>, basis: &Arc<CombinationBasis>, q: &[f64], u: &[f64]) -> Self {
        let mut motion = Self {
            scene: Arc::clone(scene),
            bases: Vec::new(),
            current: 0,
            modal: ModalMotion::default(),
            taylor: TaylorMotion::default(),
            law: None,
            blocks: Vec::new(),
        };
        motion.restart(basis, q, u);
        motion
    }

    /// Begins another phase.
    pub fn restart(&mut self, basis: &Arc<CombinationBasis>, q: &[f64], u: &[f64]) {
        self.current =
            self.bases.iter().position(|known| Arc::ptr_eq(known, basis)).unwrap_or_else(|| {
                let numbers: usize = self.bases.iter().map(|basis| basis.numbers()).sum();
                if self.bases.len() == REMEMBERED || numbers > HELD {
                    self.bases.clear();
                }
                self.bases.push(Arc::clone(basis));
                self.bases.len() - 1
            });
        match &basis.propagator {
            Propagator::Modal(modal) => self.modal.restart(modal, q, u),
            Propagator::Taylor(operator) => {
                let scene = basis.scene(&self.scene);
                self.taylor.restart(scene, operator, &basis.functions, q, u);
            }
            Propagator::Law(operator) => {
                let law = self.law.get_or_insert_default();
                let scene = basis.scene(&self.scene);
                law.restart(scene, operator, &basis.functions, q, u);
            }
            Propagator::Blocks(parts) => {
                self.blocks.truncate(parts.len());
                for (index, (block, basis)) in parts.iter().enumerate() {
                    let (q, u) = (block.gather(q), block.gather(u));
                    match self.blocks.get_mut(index) {
                        Some(part) => {
                            part.motion.restart(basis, &q, &u);
                            (part.q, part.u) = (q, u);
                        }
                        None => {
                            let motion = Motion::new(&block.scene, basis, &q, &u);
                            self.blocks.push(BlockMotion { motion, q, u });
                        }
                    }
                }
            }
        }
    }

    /// Local time at which the next panel begins.
    pub fn start(&self) -> f64 {
        match &self.bases[self.current].propagator {
            Propagator::Modal(_) => self.modal.start(),
            Propagator::Taylor(_) => self.taylor.start(),
            Propagator::Law(_) => self.law.as_ref().expect(BEGUN).start(),
            Propagator::Blocks(_) => {
                self.blocks.iter().map(|part| part.motion.start()).fold(0.0, f64::max)
            }
        }
    }

    /// The same motion as one in which events can be searched for; none of a scene in blocks.
    pub fn coupled(&mut self) -> Option<CoupledMotion<'_>> {
        let kind = match &self.bases[self.current].propagator {
            Propagator::Modal(modal) => Kind::Modal(&mut self.modal, modal),
            Propagator::Taylor(operator) => Kind::Taylor(&mut self.taylor, operator),
            Propagator::Law(operator) => Kind::Law(self.law.as_mut().expect(BEGUN), operator),
            Propagator::Blocks(_) => return None,
        };
        let scene = self.bases[self.current].scene(&self.scene);
        Some(CoupledMotion {
            functions: &self.bases[self.current].functions,
            basis: &self.bases[self.current],
            scene,
            kind,
        })
    }

    /// (q, q') at local time `time`, from the start of the panel on.
    pub fn seek(&mut self, time: f64, q: &mut [f64], u: &mut [f64]) {
        match &self.bases[self.current].propagator {
            // Modes reach any time in one step.
            Propagator::Modal(modal) => {
                let offset = time - self.modal.start();
                self.modal.state(modal, offset, q, u);
            }
            Propagator::Taylor(operator) => {
                while time > self.taylor.end() {
                    self.taylor.advance(self.bases[self.current].scene(&self.scene), operator);
                }
                self.taylor.state(operator, time - self.taylor.start(), q, u);
            }
            Propagator::Law(operator) => {
                let law = self.law.as_mut().expect(BEGUN);
                if law.reach(self.bases[self.current].scene(&self.scene), operator, time) {
                    law.state(operator, time - law.start(), q, u);
                } else {
                    // The motion has left the range of numbers before, or its law has ended: there is no state.
                    [q, u].into_iter().for_each(|half| half.fill(f64::NAN));
                    return;
                }
            }
            Propagator::Blocks(parts) => {
                for ((block, _), part) in parts.iter().zip(&mut self.blocks) {
                    part.motion.seek(time, &mut part.q, &mut part.u);
                    block.scatter(&part.q, q);
                    block.scatter(&part.u, u);
                }
            }
        }
        self.bases[self.current].complete(q, u);
    }

    /// Carries neighbours (dq, dq') of a phase under laws of friction from its start to local time `time`.
    pub fn carry(&mut self, time: f64, neighbours: &mut [Vec<f64>]) {
        if let Propagator::Law(operator) = &self.bases[self.current].propagator {
            let law = self.law.as_mut().expect(BEGUN);
            law.carry(self.bases[self.current].scene(&self.scene), operator, time, neighbours);
        }
    }

    /// Gives up motions under laws of friction in which a velocity exceeds this one: they have no states from there on.
    pub fn give_up_beyond(&mut self, speed: f64) {
        if let Some(law) = &mut self.law {
            law.most_speed = Some(speed);
        }
    }

    /// Of neighbours carried up to the end of a slip in a plane: how the time that is left grows with velocities, by coordinates.
    pub fn time_left_by_slip(&self) -> Option<[(usize, f64); 2]> {
        let Propagator::Law(operator) = &self.bases[self.current].propagator else { return None };
        self.law.as_ref()?.time_left_by_slip(operator)
    }

    /// The time until the slip of a contact in a plane ends, where this is not after `most`, s.
    pub fn slip_lasts(&mut self, contact: usize, most: f64) -> Option<f64> {
        let Propagator::Law(operator) = &self.bases[self.current].propagator else { return None };
        let law = self.law.as_mut()?;
        let scene = self.bases[self.current].scene(&self.scene);
        while law.stopped(operator).is_empty() && law.end() < most {
            law.advance(scene, operator);
        }
        law.stopped(operator).contains(&contact).then(|| law.start())
    }

    /// Local time up to which the motion after `time` is one series, where it is not smooth everywhere.
    pub fn smooth_until(&mut self, time: f64) -> Option<f64> {
        let Propagator::Law(operator) = &self.bases[self.current].propagator else { return None };
        let law = self.law.as_mut().expect(BEGUN);
        let reached =
            law.reach(self.bases[self.current].scene(&self.scene), operator, time.next_up());
        (reached && law.end() > time).then(|| law.end())
    }

    /// A bound of the growth of the state around a local time, `|X(t + z)| <= A e^{rate |z|}`; modes that have
    /// decayed below rounding of the velocity do not count. 1/s.
    pub fn growth_rate(&self, time: f64) -> f64 {
        match &self.bases[self.current].propagator {
            Propagator::Modal(modal) => self.modal.growth_rate(modal, time - self.modal.start()),
            Propagator::Taylor(operator) => operator.norm(),
            Propagator::Law(operator) => self.law.as_ref().expect(BEGUN).rate(operator),
            Propagator::Blocks(_) => {
                let rates = self.blocks.iter().map(|part| part.motion.growth_rate(time));
                rates.fold(0.0, f64::max)
            }
        }
    }
}

impl CoupledMotion<'_> {
    /// Local time at which the next panel begins.
    pub fn start(&self) -> f64 {
        match &self.kind {
            Kind::Modal(motion, _) => motion.start(),
            Kind::Taylor(motion, _) => motion.start(),
            Kind::Law(motion, _) => motion.start(),
        }
    }

    /// Whether no law of slip speed acts: the motion is then the same function of time before the start of its panel.
    pub fn is_linear(&self) -> bool {
        !matches!(self.kind, Kind::Law(..))
    }

    /// The contacts in planes whose slip has ended where the panel begins.
    pub fn stopped(&self) -> Vec<usize> {
        match &self.kind {
            Kind::Law(motion, operator) => motion.stopped(operator),
            _ => Vec::new(),
        }
    }

    /// Whose law does not hold from here on, and why.
    pub fn exhausted(&self) -> Option<(LawOf, LawEnd)> {
        match &self.kind {
            Kind::Law(motion, _) => motion.exhausted(),
            _ => None,
        }
    }

    /// Fills `panel` with the event functions on the next stretch. Before it, stretches on which no function
    /// can vanish may be passed over, up to the local time `remaining`.
    #[inline(always)]
    pub fn expand(&mut self, remaining: f64, panel: &mut Panel) {
        match &mut self.kind {
            Kind::Modal(motion, modal) => motion.expand(modal, remaining, panel),
            Kind::Taylor(motion, operator) => {
                motion.expand(self.scene, operator, self.functions, panel);
            }
            Kind::Law(motion, operator) => motion.expand(operator, self.functions, panel),
        }
        if !self.basis.cones.is_empty() {
            panel.form_cones(&self.basis.cones);
        }
    }

    /// Moves on to the end of the panel last expanded.
    pub fn advance(&mut self) {
        match &mut self.kind {
            Kind::Modal(motion, modal) => motion.advance(modal),
            Kind::Taylor(motion, operator) => {
                motion.advance(self.scene, operator);
            }
            Kind::Law(motion, operator) => motion.advance(self.scene, operator),
        }
    }

    /// (q, q') at `offset` after the start of the panel, written over `q` and `u`.
    pub fn state(&mut self, offset: f64, q: &mut [f64], u: &mut [f64]) {
        match &mut self.kind {
            Kind::Modal(motion, modal) => motion.state(modal, offset, q, u),
            Kind::Taylor(motion, operator) => motion.state(operator, offset, q, u),
            Kind::Law(motion, operator) => motion.state(operator, offset, q, u),
        }
        self.basis.complete(q, u);
    }
}
