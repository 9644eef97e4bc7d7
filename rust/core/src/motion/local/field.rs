//! The motion of all coordinates on one panel, each by a series of its own.
//!
//! All series begin with the panel. An event restarts the series that it reaches before the panel ends; the others go on.
//! The error of this is proved to be below rounding; see `reach.rs`.

use std::sync::Arc;

use pulp::cast;
use serde::{Deserialize, Serialize};

use crate::contact::event_function::EventFunction;
use crate::motion::local::blocks::{BLOCK, Shift, Values, first_term};
use crate::motion::local::locality::Course;
use crate::motion::local::reach::{NEGLECTED, Reaches};
use crate::motion::local::region::{Region, TERMS};
use crate::motion::panel::Panel;
use crate::numerics::simd::{GROUP, VectorUnit, group};
use crate::scene::model::Scene;
use crate::scene::status::Status;

/// A place and a speed that an event sets.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Reset {
    pub coordinate: usize,
    pub q: f64,
    pub u: f64,
}

/// All coordinates on one panel; times count from its start, in s.
#[derive(Debug)]
pub(crate) struct Field {
    scene: Arc<Scene>,
    locality: Arc<Reaches>,
    /// The time up to which all series hold.
    pub end: f64,
    /// Largest norm of the state so far.
    scale: f64,
    /// Bounds of the terms that series leave out, and of those that restarts have left out.
    tail: f64,
    neglected: f64,
    /// Of each coordinate: when its series begins, and its unit of time; up to whole blocks.
    start: Vec<f64>,
    width: Vec<f64>,
    origin: Vec<f64>,
    /// The speed at which sliders carry coordinates, which rounding of the series does not change.
    carried: Vec<Option<f64>>,
    /// Displacements from the origin, in blocks.
    terms: Vec<f64>,
    /// All coordinates, whose rows stay while the statuses do, and what an event restarts.
    whole: Region,
    statuses: Vec<Status>,
    part: Region,
    /// Which of them was expanded last.
    restarted: bool,
    unit: VectorUnit,
}

impl Field {
    pub fn new(scene: &Arc<Scene>, locality: &Arc<Reaches>) -> Self {
        let n = scene.size;
        let blocks = n.div_ceil(GROUP);
        Self {
            scene: Arc::clone(scene),
            locality: Arc::clone(locality),
            end: 0.0,
            scale: 0.0,
            tail: 0.0,
            neglected: 0.0,
            start: vec![0.0; blocks * GROUP],
            width: vec![1.0; blocks * GROUP],
            origin: vec![0.0; n],
            carried: vec![None; n],
            terms: vec![0.0; blocks * BLOCK],
            whole: Region::default(),
            statuses: Vec::new(),
            part: Region::default(),
            restarted: false,
            unit: VectorUnit::default(),
        }
    }

    /// Begins a panel from (q, q').
    pub fn begin(&mut self, statuses: &[Status], q: &[f64], u: &[f64]) {
        let Self { scene, locality, whole, .. } = self;
        whole.width = locality.width();
        if whole.members.is_empty() || self.statuses != statuses {
            self.statuses.clear();
            self.statuses.extend_from_slice(statuses);
            whole.enclose(scene, locality, statuses, 0..scene.size);
        }
        for k in 0..scene.size {
            set(whole, k, q[k], 0.0, u[k]);
        }
        (self.end, self.scale, self.tail, self.neglected) = (f64::INFINITY, 0.0, 0.0, 0.0);
        self.restarted = false;
        self.expand(0.0);
    }

    /// Restarts the series that events of these contacts reach, from the places and speeds that the events have set.
    pub fn restart(&mut self, statuses: &[Status], contacts: &[usize], resets: &[Reset], at: f64) {
        let rest = self.end - at;
        let Self { scene, locality, part: region, .. } = self;
        let reaches: Vec<_> = contacts.iter().map(|&contact| locality.of(scene, contact)).collect();
        let share = rest / locality.width();
        let reached = reaches.iter().flat_map(|reach| reach.within(share));
        region.width = rest;
        region.enclose(scene, locality, statuses, reached);
        let mut known = None;
        for j in 0..self.part.within {
            let k = self.part.members[j];
            // Neighbours often share a block.
            let (_, [q, u]) = match known {
                Some((block, values)) if block == k / GROUP => (block, values),
                _ => (k / GROUP, self.displacements(k / GROUP, at)),
            };
            known = Some((k / GROUP, [q, u]));
            let (displacement, speed) = (q[k % GROUP], self.carried[k].unwrap_or(u[k % GROUP]));
            let origin = self.origin[k] + displacement;
            set(&mut self.part, j, origin, (self.origin[k] - origin) + displacement, speed);
        }
        let rim: Vec<usize> = self.part.members[self.part.within..].to_vec();
        for (block, members) in rim.chunks(GROUP).enumerate() {
            self.shift(self.part.within + block * GROUP, members, at);
        }
        for reset in resets {
            if let Some(j) = self.part.place(reset.coordinate) {
                set(&mut self.part, j, reset.q, 0.0, reset.u);
            }
        }
        self.neglected += contacts.len() as f64 * NEGLECTED;
        self.restarted = true;
        self.expand(at);
    }

    /// Fills the series of the region and takes them over.
    fn expand(&mut self, at: f64) {
        let Self { scene, locality, whole, part, .. } = self;
        let region = if self.restarted { part } else { whole };
        region.fill(scene);
        self.scale = self.scale.max(region.scale(locality));
        self.tail = self.tail.max(region.shorten(locality, self.scale));
        self.end = self.end.min(at + region.width);
        region.measure(locality);
        let count = region.members.len();
        for (j, &k) in region.members[..region.within].iter().enumerate() {
            self.start[k] = at;
            self.width[k] = region.width;
            self.origin[k] = region.origin[j];
            self.carried[k] = match region.course(j) {
                Course::Carried(speed) => Some(speed),
                _ => None,
            };
        }
        for (block, members) in region.members[..region.within].chunks(GROUP).enumerate() {
            let places = members.iter().map(|&k| first_term(k));
            let first = first_term(members[0]);
            let is_block = members.len() == GROUP
                && members[0].is_multiple_of(GROUP)
                && places.eq(first..first + GROUP);
            for (order, own) in region.terms.chunks_exact(count).enumerate() {
                let own = &own[block * GROUP..][..members.len()];
                if is_block {
                    self.terms[first + order * GROUP..][..GROUP].copy_from_slice(own);
                } else {
                    for (&k, term) in members.iter().zip(own) {
                        self.terms[first_term(k) + order * GROUP] = *term;
                    }
                }
            }
        }
    }

    /// What was expanded last.
    fn region(&self) -> &Region {
        if self.restarted { &self.part } else { &self.whole }
    }

    /// Coordinates expanded last.
    pub fn expanded(&self) -> &[usize] {
        &self.region().members[..self.region().within]
    }

    /// The width of the series expanded last, which is the unit of its panel of event functions.
    pub fn unit(&self) -> f64 {
        self.region().width
    }

    /// Event functions of a contact among the coordinates expanded last.
    pub fn functions(&self, functions: &[EventFunction], panel: &mut Panel) {
        let left_out = self.tail + self.neglected * self.scale;
        self.region().expand(&self.locality, functions, left_out, panel);
    }

    /// Displacements and speeds of a block.
    fn displacements(&self, block: usize, at: f64) -> [[f64; GROUP]; 2] {
        let [mut q, mut u] = [[0.0; GROUP]; 2];
        let own = block * GROUP..(block + 1) * GROUP;
        self.unit.run(Values {
            terms: &self.terms[block * BLOCK..(block + 1) * BLOCK],
            start: &self.start[own.clone()],
            width: &self.width[own],
            at,
            q: &mut q,
            u: &mut u,
        });
        [q, u]
    }

    /// (q, q') of a coordinate.
    pub fn value(&self, k: usize, at: f64) -> (f64, f64) {
        let [q, u] = self.displacements(k / GROUP, at);
        (self.origin[k] + q[k % GROUP], self.carried[k].unwrap_or(u[k % GROUP]))
    }

    /// (q, q') of all coordinates.
    pub fn values(&self, at: f64, q: &mut [f64], u: &mut [f64]) {
        let Self { terms, start, width, .. } = self;
        self.unit.run(Values { terms, start, width, at, q, u });
        q.iter_mut().zip(&self.origin).for_each(|(q, origin)| *q += origin);
        for (u, carried) in u.iter_mut().zip(&self.carried) {
            *u = carried.unwrap_or(*u);
        }
    }

    /// Enters the series of some of the rim into the region, from a place on: about another time and in its unit.
    fn shift(&mut self, place: usize, members: &[usize], at: f64) {
        let mut terms: [[f64; GROUP]; TERMS] = [[0.0; GROUP]; TERMS];
        let [mut s, mut factor] = [[0.0; GROUP]; 2];
        for (lane, &k) in members.iter().enumerate() {
            let own = self.terms[first_term(k)..].iter().step_by(GROUP);
            terms.iter_mut().zip(own).for_each(|(terms, term)| terms[lane] = *term);
            s[lane] = (at - self.start[k]) / self.width[k];
            factor[lane] = self.part.width / self.width[k];
        }
        let mut terms = terms.map(group);
        self.unit.run(Shift { terms: &mut terms, s, factor });
        let terms: [[f64; GROUP]; TERMS] = terms.map(cast);
        let count = self.part.members.len();
        for (own, terms) in self.part.terms.chunks_exact_mut(count).zip(&terms) {
            own[place..][..members.len()].copy_from_slice(&terms[..members.len()]);
        }
        for (lane, &k) in members.iter().enumerate() {
            let (j, displacement) = (place + lane, terms[0][lane]);
            let origin = self.origin[k] + displacement;
            self.part.origin[j] = origin;
            self.part.terms[j] = displacement + (self.origin[k] - origin);
        }
    }
}

/// Sets the start of a member of a region: a place, its rounding, and a speed; coordinates that a contact holds keep the
/// values that it prescribes.
fn set(region: &mut Region, member: usize, place: f64, rest: f64, speed: f64) {
    let count = region.members.len();
    let (place, rest, speed) = match region.course(member) {
        Course::Free(_) => (place, rest, speed),
        Course::Carried(speed) => (place, rest, speed),
        Course::Closed => (0.0, 0.0, 0.0),
    };
    region.origin[member] = place;
    region.terms[member] = rest;
    region.terms[count + member] = speed * region.width;
}

#[cfg(test)]
pub(super) mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::linalg::SparseMatrix;
    use crate::motion::local::locality::Locality;
    use crate::motion::local::reach::Reach;
    use crate::scene::{ContactInput, Damping, Direction, Mass, SceneInput};

    /// Cells of a tangential and a normal dof on a slider, tied in a chain, a grid or a star.
    pub fn cells(kind: usize, count: usize, numbers: &[f64], beta: Option<f64>) -> Arc<Scene> {
        let mut numbers = numbers.iter().cycle().copied();
        let mut stiffness = nalgebra::DMatrix::zeros(2 * count, 2 * count);
        let mut tie = |i: usize, j: Option<usize>, k: f64| {
            stiffness[(i, i)] += k;
            if let Some(j) = j {
                stiffness[(j, j)] += k;
                stiffness[(i, j)] -= k;
                stiffness[(j, i)] -= k;
            }
        };
        let mut spring = || 1e3 * 30f64.powf(numbers.next().unwrap_or(0.5));
        let side = count.isqrt();
        for cell in 0..count {
            let (t, n) = (2 * cell, 2 * cell + 1);
            tie(t, None, spring());
            tie(n, None, spring());
            tie(t, Some(n), spring());
            let others: Vec<usize> = match kind {
                0 => cell.checked_sub(1).into_iter().collect(),
                1 => [(cell % side > 0).then_some(1), (cell >= side).then_some(side)]
                    .into_iter()
                    .flatten()
                    .map(|back| cell - back)
                    .collect(),
                _ => (cell > 0).then_some(0).into_iter().collect(),
            };
            for other in others {
                tie(t, Some(2 * other), spring());
                tie(n, Some(2 * other + 1), spring());
            }
        }
        let contact = |cell: usize| ContactInput {
            tangential: Some(Direction::Dof(2 * cell)),
            normal: Some(Direction::Dof(2 * cell + 1)),
            friction: 0.6,
            static_friction: 0.6,
            slider_speed: 0.1,
            ..Default::default()
        };
        let stiffness = SparseMatrix::from_dense(&stiffness);
        let damping = match beta {
            Some(stiffness) => Damping::Proportional { mass: 1.0, stiffness },
            None => Damping::General(stiffness.scaled(1e-4).combined(
                1.0,
                &SparseMatrix::diagonal(&vec![3.0; 2 * count]),
                1.0,
            )),
        };
        let input = SceneInput {
            mass: Mass::Lumped((0..2 * count).map(|k| 0.5 + (k as f64).sin().abs()).collect()),
            stiffness,
            damping,
            force: vec![-20.0; 2 * count],
            contacts: (0..count).map(contact).collect(),
            ..Default::default()
        };
        Arc::new(Scene::new(input).expect("well-posed"))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(96))]

        /// One contact changes its status and its velocity. Against the motion of which every coordinate is expanded anew:
        /// what lies beyond a reach differs by no more than the reach leaves out, for any bound of that, and what a restart
        /// leaves differs by rounding.
        #[test]
        fn nothing_beyond_the_reach_moves(
            kind in 0usize..3,
            count in 9usize..60,
            numbers in proptest::collection::vec(0.0..1.0f64, 240),
            beta in prop_oneof![Just(None), (0.0..3e-4f64).prop_map(Some)],
            share in 0.0..0.9f64,
            changes in (0usize..4, 0usize..4),
            statuses in proptest::collection::vec(0usize..4, 60),
        ) {
            let scene = cells(kind, count, &numbers, beta);
            let locality = Arc::new(Reaches::new(Locality::new(&scene).expect("lumped")));
            let all = [Status::Positive, Status::Negative, Status::Sticking, Status::Detached];
            let contact = count / 2;
            let mut before: Vec<Status> = statuses[..count].iter().map(|&s| all[s]).collect();
            before[contact] = all[changes.0];
            let mut after = before.clone();
            after[contact] = all[changes.1];
            let n = scene.size;
            let mut q: Vec<f64> = numbers.iter().cycle().take(n).map(|x| 1e-3 * x).collect();
            let mut u: Vec<f64> = numbers.iter().rev().cycle().take(n).map(|x| x - 0.5).collect();
            for (law, status) in scene.contacts.iter().zip(&before) {
                if status.is_closed() {
                    (q[law.normal], u[law.normal]) = (0.0, 0.0);
                }
            }
            let mut field = Field::new(&scene, &locality);
            field.begin(&before, &q, &u);
            let at = share * field.end;
            let law = &scene.contacts[contact];
            field.values(at, &mut q, &mut u);
            q[law.normal] = 0.0;
            u[law.normal] = if after[contact] == Status::Detached { 0.3 } else { 0.0 };
            u[law.tangential] = if after[contact] == Status::Sticking { law.slider_speed } else { -0.2 };
            let resets = [law.tangential, law.normal].map(|k| Reset { coordinate: k, q: q[k], u: u[k] });
            let mut whole = Field::new(&scene, &locality);
            whole.begin(&after, &q, &u);
            let scale = whole.scale.max(field.scale);
            let until = (field.end - at).min(whole.end);
            let rest = field.end - at;
            let error = |k: usize, other: &Field, from: f64| {
                let mut largest = 0.0_f64;
                for step in 0..9 {
                    let time = until * f64::from(step) / 8.0;
                    let ((q, u), (p, v)) = (other.value(k, from + time), whole.value(k, time));
                    largest = largest.max(locality.omega * (q - p).abs()).max((u - v).abs());
                }
                locality.weight[k] * largest / scale
            };
            for neglected in [1e-2, 1e-4, 1e-7, 1e-10] {
                let reach = Reach::new(&scene, &locality, contact, neglected);
                let within: Vec<usize> = reach.within(rest / locality.width()).collect();
                for k in (0..n).filter(|k| !within.contains(k)) {
                    prop_assert!(error(k, &field, at) <= neglected + 1e-12);
                }
            }
            field.restart(&after, &[contact], &resets, at);
            for k in 0..n {
                prop_assert!(error(k, &field, at) <= 1e-13, "{}", error(k, &field, at));
            }
        }
    }
}
