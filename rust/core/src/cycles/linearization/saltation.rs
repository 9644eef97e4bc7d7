//! The effect of an event on a motion and on its neighbours.
//!
//! A phase ends where its event function h(y) vanishes; the state jumps, `y+ = g(y-)`, and the next vector
//! field takes over. A neighbour gets there `dt = -grad h . dy / (grad h . f-)` later, so that at equal
//! times (M. A. Aizerman, F. R. Gantmakher, "On the stability of periodic motions", J. Appl. Math. Mech. 22,
//! 1958; R. I. Leine, H. Nijmeijer, "Dynamics and Bifurcations of Non-Smooth Mechanical Systems", 2004, ch. 7)
//!
//! ```text
//! dy+ = Dg (dy- + f- dt) - f+ dt = S dy-,   S = Dg + (f+ - Dg f-) grad h' / (grad h . f-)
//! ```
//!
//! The end of a series of bounces has no event function of its own: its time `-2 g' / (g'' (1 - e))` after
//! the last bounce (see `event_search`) gives dt instead. A neighbour that is dg away from that bounce at equal times
//! gets there `dg / g'` later, and its limit comes `(1 + e) / (1 - e) dg / g'` later than at the same speed.
//! Where mass couples contacts, several of them close at the end of a series: see `joint`.

use nalgebra::{DMatrix, DVector, Matrix2, RowDVector, Vector2};
use serde::{Deserialize, Serialize};

use crate::contact::event_function::{EventFunction, ending, event_functions};
use crate::contact::event_kind::{EventKind, Set};
use crate::contact::functional::Functional;
use crate::contact::linear_friction::of_phase;
use crate::contact::transition;
use crate::cycles::linearization::coupled_impact::coupled_impact;
use crate::cycles::linearization::event::EventValue;
use crate::cycles::linearization::flow::Flow;
use crate::cycles::linearization::joint::Closing;
use crate::error::run::RunFailure;
use crate::linalg::sparse::SparseMatrix;
use crate::scene::contact_law::Plane;
use crate::scene::model::Scene;
use crate::scene::status::Combination;

/// The event that ends a phase: its contact and its kind.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Passage {
    pub contact: usize,
    pub trigger: EventKind,
    /// It follows from the scene, like the companions.
    #[serde(skip)]
    event: EventValue,
    /// The contacts that close for good with the impact of `contact`; empty unless it ends a series over several contacts.
    pub series: Vec<usize>,
    /// The contacts whose directions depend on those of `contact` so that the same event happens to them at the same instant.
    #[serde(skip)]
    pub companions: Vec<usize>,
}

/// The derivatives of a passage at one motion, over (q, q').
#[derive(Debug)]
pub(crate) struct Linearised {
    /// Event function at the end of the phase; 0 where its time is known explicitly.
    pub value: f64,
    /// d(time of the event) / d(state at the start of the phase).
    pub timing: Vec<f64>,
    /// grad h . f-, 1 where the time is explicit.
    pub speed: f64,
    /// f-
    pub field: Vec<f64>,
    /// Dg
    pub jump: SparseMatrix,
    /// Dg Phi
    pub carried: DMatrix<f64>,
}

impl Passage {
    pub fn new(scene: &Scene, before: &Combination, contact: usize, trigger: EventKind) -> Self {
        let linear = of_phase(scene, before);
        let event = ending(&linear, before, contact, trigger);
        let companions = companions(&linear, before, contact, trigger, &event.functional);
        let event = EventValue::new(scene, before, event);
        Self { contact, trigger, event, series: Vec::new(), companions }
    }

    /// The impact of contact `struck` with which all contacts of a series close.
    pub fn joint(scene: &Scene, before: &Combination, struck: usize, series: Vec<usize>) -> Self {
        let impact = Self::new(scene, before, struck, EventKind::Impact);
        Self { trigger: EventKind::Accumulation, series, ..impact }
    }

    /// The same in another scene, from the same combination.
    pub fn transferred(&self, scene: &Scene, before: &Combination) -> Self {
        match self.is_joint() {
            true => Self::joint(scene, before, self.contact, self.series.clone()),
            false => Self::new(scene, before, self.contact, self.trigger),
        }
    }

    /// Its contact and the companions.
    pub fn own(&self) -> impl Iterator<Item = usize> + '_ {
        std::iter::once(self.contact).chain(self.companions.iter().copied())
    }

    /// Whether several contacts close with it.
    pub const fn is_joint(&self) -> bool {
        !self.series.is_empty()
    }

    /// A combination in which the contacts that this passage moves are as in another one.
    pub fn settled(
        &self,
        scene: &Scene,
        between: &Combination,
        after: &Combination,
    ) -> Combination {
        if self.trigger == EventKind::Load {
            // It may move any contact.
            return after.clone();
        }
        let moved = self.own().chain(self.series.iter().copied());
        moved.fold(between.clone(), |settled, contact| {
            scene.with_status(&settled, contact, after.statuses()[contact])
        })
    }

    /// Whether it ends a slip in a plane, whose time is known explicitly.
    pub fn stops_in_plane(&self, scene: &Scene) -> bool {
        let contact = scene.contacts.get(self.contact);
        self.trigger == EventKind::Velocity
            && contact.is_some_and(|law| law.plane.is_some() && !law.is_elastic())
    }

    /// The event function in a state, and the scale of its terms.
    pub fn value(&self, flow: &Flow<'_>, state: &[f64]) -> (f64, f64) {
        self.event.value(flow, state)
    }

    /// `y+ = g(y-)`, in place.
    pub fn jump(
        &self,
        scene: &Scene,
        before: &Combination,
        state: &mut [f64],
    ) -> Result<(), RunFailure> {
        if self.is_joint() {
            self.strike(scene, before, state)?;
            Closing::new(scene, before, self.contact, &self.series, state)?.close(state);
            return Ok(());
        }
        if self.trigger == EventKind::Impact {
            self.strike(scene, before, state)?;
        } else {
            let (q, u) = state.split_at_mut(scene.size);
            self.sets(scene).for_each(|set| set.apply(q, u));
        }
        if self.changes_normal_forces() {
            let (q, u) = state.split_at_mut(scene.size);
            scene.return_springs(before, q, u);
        }
        Ok(())
    }

    /// Whether normal forces of contacts that stay closed may jump with it.
    const fn changes_normal_forces(&self) -> bool {
        matches!(self.trigger, EventKind::Impact | EventKind::Load)
    }

    /// What the event sets of its contact and of the companions.
    fn sets<'a>(&'a self, scene: &'a Scene) -> impl Iterator<Item = Set> + 'a {
        let contacts = self.own().filter_map(|contact| scene.contacts.get(contact));
        contacts.flat_map(|contact| self.trigger.sets(contact))
    }

    /// The impact of the contact, in place.
    fn strike(
        &self,
        scene: &Scene,
        before: &Combination,
        state: &mut [f64],
    ) -> Result<(), RunFailure> {
        let (q, u) = state.split_at_mut(scene.size);
        let struck: Vec<usize> = self.own().collect();
        let contacts = struck.iter().map(|&contact| &scene.contacts[contact]);
        contacts
            .flat_map(|contact| EventKind::Impact.sets(contact))
            .for_each(|set| set.apply(q, u));
        transition::impact(scene, before.statuses(), &struck, q, u)
    }

    /// All derivatives at a phase from `start` to `end`, which jumps to `arrived`.
    pub fn linearised(
        &self,
        scene: &Scene,
        flow: &Flow<'_>,
        transition: &DMatrix<f64>,
        [start, end, arrived]: [&[f64]; 3],
    ) -> Result<Linearised, RunFailure> {
        let n = scene.size;
        let size = 2 * n;
        let field = flow.field(end);
        let jump = self.jump_matrix(scene, flow.combination(), end, arrived)?;
        let (value, timing, speed) = match self.trigger {
            EventKind::Accumulation if !self.is_joint() => {
                let law = &scene.contacts[self.contact];
                let acceleration = flow.field(start)[n + law.normal];
                let mut timing = vec![0.0; size];
                let lost = 1.0 - law.restitution;
                timing[n + law.normal] = -2.0 / (acceleration * lost);
                timing[law.normal] = (1.0 + law.restitution) / (lost * start[n + law.normal]);
                (0.0, timing, 1.0)
            }
            _ if self.stops_in_plane(scene) => {
                let delay =
                    |column: usize| flow.delay_of_stop(transition.column(column).as_slice());
                (0.0, (0..size).map(delay).collect(), 1.0)
            }
            _ => {
                let speed = self.event.rate(flow, end, &field);
                let along = |column: usize| {
                    -self.event.rate(flow, end, transition.column(column).as_slice()) / speed
                };
                (self.value(flow, end).0, (0..size).map(along).collect(), speed)
            }
        };
        let carried = jump.times(transition);
        Ok(Linearised { value, timing, speed, field, jump, carried })
    }

    /// A neighbour at the end of a phase as it is just after its own event, without the matrices.
    pub fn carried(
        &self,
        scene: &Scene,
        flow: &Flow<'_>,
        [start, end, arrived]: [&[f64]; 3],
        neighbour: &[f64],
    ) -> Result<Vec<f64>, RunFailure> {
        let n = scene.size;
        let field = flow.field(end);
        let delay = match self.trigger {
            // The time to the limit of the bounces counts from the start, an instant before.
            EventKind::Accumulation if !self.is_joint() => {
                let law = &scene.contacts[self.contact];
                let acceleration = flow.field(start)[n + law.normal];
                -2.0 * neighbour[n + law.normal] / (acceleration * (1.0 - law.restitution))
            }
            _ if self.stops_in_plane(scene) => flow.delay_of_stop(neighbour),
            _ => -self.event.rate(flow, end, neighbour) / self.event.rate(flow, end, &field),
        };
        let moved: Vec<f64> = neighbour.iter().zip(&field).map(|(dy, f)| dy + f * delay).collect();
        Ok(self.jump_matrix(scene, flow.combination(), end, arrived)?.apply(&moved))
    }

    /// Dg
    fn jump_matrix(
        &self,
        scene: &Scene,
        before: &Combination,
        end: &[f64],
        arrived: &[f64],
    ) -> Result<SparseMatrix, RunFailure> {
        let n = scene.size;
        if self.is_joint() {
            let mut between = end.to_vec();
            self.strike(scene, before, &mut between)?;
            let closing = Closing::new(scene, before, self.contact, &self.series, &between)?;
            let impact = Self::new(scene, before, self.contact, EventKind::Impact);
            let matrix = impact.jump_matrix(scene, before, end, &between)?;
            return Ok(SparseMatrix::from_dense(&closing.projection).product(&matrix));
        }
        let mut matrix = DMatrix::identity(2 * n, 2 * n);
        // The gap is zero at an impact; the time shift does the rest.
        for entry in self.sets(scene).map(|set| set.entry(n)) {
            matrix[(entry, entry)] = 0.0;
        }
        if self.trigger == EventKind::Impact {
            let law = &scene.contacts[self.contact];
            let (t, g) = (n + law.tangential, n + law.normal);
            match &scene.coordinates.delassus {
                Some(w) => {
                    let struck: Vec<usize> = self.own().collect();
                    coupled_impact(scene, w, before, &struck, end, arrived, &mut matrix);
                }
                None => {
                    matrix[(g, g)] = -law.restitution;
                    if let Some(plane) = law.plane.filter(|_| scene.impact_friction) {
                        self.impact_in_plane(scene, plane, [end, arrived], &mut matrix);
                    } else if scene.impact_friction && arrived[t] == law.slider_speed {
                        matrix[(t, t)] = 0.0;
                    } else if scene.impact_friction {
                        // |g'| = -g' before an impact, and the law counts at the slip velocity then.
                        let ratio = scene.mass.get(law.normal, law.normal)
                            / scene.mass.get(law.tangential, law.tangential);
                        let slip = (end[t] - law.slider_speed).signum();
                        let impulse = (1.0 + law.restitution) * ratio;
                        let slope = scene.friction_slope(self.contact, &end[n..]);
                        matrix[(t, t)] = 1.0 + slope * impulse * end[g];
                        matrix[(t, g)] =
                            slip * scene.friction_at(self.contact, &end[n..]) * impulse;
                    }
                }
            }
        }
        if self.changes_normal_forces() {
            scene.differentiate_return(before, [end, arrived], &mut matrix);
        }
        Ok(SparseMatrix::from_dense(&matrix))
    }

    /// What the impulse of friction in a plane changes of the slip velocities w. Of `M w+ + p e+ = M w-` with `e = w / |w|` and
    /// `p = mu (1 + restitution) m_n |g'|` follows `(M + p (I - e e') / |w+|) dw+ = M dw- - e dp`, with mu at the slip speed before the
    /// impact; nothing changes a stop.
    fn impact_in_plane(
        &self,
        scene: &Scene,
        plane: Plane,
        [end, arrived]: [&[f64]; 2],
        matrix: &mut DMatrix<f64>,
    ) {
        let law = &scene.contacts[self.contact];
        let n = scene.size;
        let rows = [n + law.tangential, n + plane.tangential];
        let sliders = Vector2::new(law.slider_speed, plane.slider_speed);
        let left = Vector2::from(rows.map(|row| arrived[row])) - sliders;
        let mass = [law.tangential, plane.tangential].map(|k| scene.mass.get(k, k));
        let mass = Matrix2::from_diagonal(&Vector2::from(mass));
        let impulse = (1.0 + law.restitution) * scene.mass.get(law.normal, law.normal);
        let by_approach = scene.friction_at(self.contact, &end[n..]) * impulse;
        let approach = n + law.normal;
        let unit = |w: Vector2<f64>| if w == Vector2::zeros() { w } else { w.normalize() };
        let came = Vector2::from(rows.map(|row| end[row])) - sliders;
        // |g'| = -g' before an impact.
        let by_speed = -end[approach] * impulse * scene.friction_slope(self.contact, &end[n..]);
        let (speed, e) = (left.norm(), unit(left));
        let across = Matrix2::identity() - e * e.transpose();
        let turned = mass - across * (by_approach * end[approach] / speed);
        let inverse = match speed == 0.0 {
            true => Matrix2::zeros(),
            false => turned.try_inverse().unwrap_or_else(Matrix2::zeros),
        };
        let by_slip = inverse * (mass - e * unit(came).transpose() * by_speed);
        let by_approach = inverse * e * by_approach;
        for i in 0..2 {
            (0..2).for_each(|j| matrix[(rows[i], rows[j])] = by_slip[(i, j)]);
            matrix[(rows[i], approach)] = by_approach[i];
        }
    }

    /// Dimension of the directions that a passage forgets: the kernel of its saltation matrix.
    ///
    /// `S dy = 0` says `Dg w = f+ dt` with `w = dy + f- dt` and `grad h . w = 0`. With k rows of zeros in Dg, the entries
    /// that the jump sets,
    ///
    /// - `Dg w = 0` has k dimensions, of which k - 1 satisfy `grad h . w = 0`, because h is among what is set;
    /// - `Dg w = f+ dt` adds one more if f+ vanishes in those rows.
    pub fn loss(&self, before: &[usize], jump: &SparseMatrix, next_field: &[f64]) -> usize {
        let set: Vec<usize> =
            before.iter().copied().filter(|&row| jump.row(row).next().is_none()).collect();
        match set.iter().any(|&row| next_field[row] != 0.0) {
            true => set.len() - 1,
            false => set.len(),
        }
    }
}

impl Linearised {
    /// The map from the start of this phase to the start of the next: `Dg (Phi + f- timing)`.
    pub fn return_map(&self) -> DMatrix<f64> {
        let pushed = DVector::from(self.jump.apply(&self.field));
        &self.carried + pushed * RowDVector::from_row_slice(&self.timing)
    }

    /// The same at equal times, `S Phi`: with f+ the next vector field.
    pub fn fundamental(&self, next_field: &[f64]) -> DMatrix<f64> {
        let next_field = DVector::from_column_slice(next_field);
        self.return_map() - next_field * RowDVector::from_row_slice(&self.timing)
    }
}

/// The contacts that have the same event function as one of them, up to a factor, because directions depend on each other.
fn companions(
    scene: &Scene,
    before: &Combination,
    contact: usize,
    trigger: EventKind,
    event: &Functional,
) -> Vec<usize> {
    if scene.dependents.is_empty() || trigger == EventKind::Accumulation {
        return Vec::new();
    }
    let fitted = scene.fitted(before);
    let own = event.pulled_back(&fitted.dependents);
    let Ok(functions) = event_functions(scene, before) else { return Vec::new() };
    let same = |other: &EventFunction| {
        other.contact != contact
            && other.trigger == trigger
            && own.is_multiple_of(&other.functional.pulled_back(&fitted.dependents))
    };
    let mut found: Vec<usize> =
        functions.iter().filter(|other| same(other)).map(|other| other.contact).collect();
    found.dedup();
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ContactInput, Damping, Direction, Mass, SceneInput};

    fn scene(mass: Mass, impact_friction: bool) -> Scene {
        let contact = ContactInput {
            tangential: Some(Direction::Dof(0)),
            normal: Some(Direction::Dof(1)),
            friction: 0.5,
            static_friction: 0.7,
            slider_speed: 0.1,
            restitution: 0.3,
            gap: 0.2,
            ..Default::default()
        };
        let input = SceneInput {
            mass,
            stiffness: SparseMatrix::diagonal(&[3.0, 5.0]),
            damping: Damping::Proportional { mass: 0.0, stiffness: 0.0 },
            force: vec![0.0, -2.0],
            contacts: vec![contact],
            impact_friction,
            ..Default::default()
        };
        Scene::new(input).expect("well-posed")
    }

    /// Jumps are piecewise linear, so that differences have rounding alone.
    #[test]
    fn the_matrix_of_a_jump_is_its_derivative() {
        const STEP: f64 = 1e-4;
        let coupled = Mass::Full(DMatrix::from_row_slice(2, 2, &[1.0, 0.2, 0.2, 1.5]));
        let lumped = Mass::Lumped(vec![1.0, 1.5]);
        for (mass, impact_friction) in [(lumped.clone(), false), (lumped, true), (coupled, true)] {
            let scene = scene(mass, impact_friction);
            let law = &scene.contacts[0];
            for (kind, letter, [slip, approach]) in [
                (EventKind::Velocity, "-", [0.0, 0.0]),
                (EventKind::Release, "+", [-0.4, 0.0]),
                (EventKind::SlipPositive, "s", [0.0, 0.0]),
                (EventKind::SlipNegative, "s", [0.0, 0.0]),
                (EventKind::Impact, "d", [0.6, -0.4]),
                (EventKind::Impact, "d", [-0.6, -0.4]),
                (EventKind::Impact, "d", [0.01, -0.4]),
                (EventKind::Accumulation, "d", [0.6, -0.4]),
            ] {
                if kind == EventKind::Accumulation && scene.contacts_coupled() {
                    continue;
                }
                let combination = Combination::parse(letter, 1).expect("a letter");
                let passage = Passage::new(&scene, &combination, 0, kind);
                let jumped = |mut state: Vec<f64>| {
                    passage.jump(&scene, &combination, &mut state).expect("a jump");
                    state
                };
                let mut end = vec![0.3; 4];
                end[law.normal] = law.closed();
                end[2 + law.tangential] = law.slider_speed + slip;
                end[2 + law.normal] = approach;
                let arrived = jumped(end.clone());
                let matrix = passage.jump_matrix(&scene, &combination, &end, &arrived);
                let matrix = matrix.expect("a jump").to_dense();
                for column in 0..4 {
                    let moved = |step: f64| {
                        let mut state = end.clone();
                        state[column] += step;
                        jumped(state)
                    };
                    let (above, below) = (moved(STEP), moved(-STEP));
                    for row in 0..4 {
                        let slope = (above[row] - below[row]) / (2.0 * STEP);
                        let error = (slope - matrix[(row, column)]).abs();
                        // Rounding of states of size 1 over the step.
                        assert!(
                            error <= 16.0 * f64::EPSILON / STEP,
                            "{kind:?} {row} {column}: {error:e}"
                        );
                    }
                }
            }
        }
    }
}
