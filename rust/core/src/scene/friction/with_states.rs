//! A scene with contacts that have states: their laws, their energy, and the scenes in which they act in one state, at rest and in
//! small motions.

use std::ops::Range;

use crate::error::input::Error;
use crate::linalg::sparse::{SparseMatrix, summed};
use crate::scene::friction::contact_state::{ContactState, InState, StateContact};
use crate::scene::model::Scene;
use crate::scene::status::Combination;

impl Scene {
    /// The state of a contact, where it has one.
    pub(crate) fn state_of(&self, contact: usize) -> Option<&StateContact> {
        self.states.iter().flat_map(|all| &all[..]).find(|own| own.0 == contact).map(|own| &own.1)
    }

    /// The same, if it is that of a law: the deflection of a spring in a plane is known by its friction force.
    pub(crate) fn internal_state_of(&self, contact: usize) -> Option<&StateContact> {
        self.state_of(contact).filter(|_| !self.contacts[contact].is_elastic())
    }

    /// Whether some contact has a state.
    pub fn has_states(&self) -> bool {
        self.states.is_some()
    }

    /// Every contact with a state.
    pub(crate) fn state_contacts(&self) -> impl Iterator<Item = &(usize, StateContact)> {
        self.states.iter().flat_map(|all| &all[..])
    }

    /// The coordinates of states, whose displacements mean nothing: nothing depends on them.
    pub(crate) fn hidden(&self) -> Range<usize> {
        let mut coordinates = self.state_contacts().map(|(_, own)| own.coordinate);
        coordinates.next().map_or(0..0, |first| first..coordinates.last().unwrap_or(first) + 1)
    }

    pub(crate) fn is_hidden(&self, coordinate: usize) -> bool {
        self.hidden().contains(&coordinate)
    }

    /// What a closed contact with a state does in a state of the scene.
    pub(crate) fn of_state(
        &self,
        contact: usize,
        combination: &Combination,
        q: &[f64],
        u: &[f64],
    ) -> Option<InState> {
        if self.contacts[contact].is_elastic() {
            return self.of_elastic_plane(contact, combination, q, u);
        }
        let (own, law) = (self.state_of(contact)?, self.friction_law(contact)?);
        Some(own.in_state(law, self.contacts[contact].slider_speed, u))
    }

    /// The kinetic energy of hidden coordinates, and the part of it that bristles store, J; its change, where velocities before
    /// are given.
    pub(crate) fn hidden_energy(&self, from: Option<&[f64]>, to: &[f64]) -> [f64; 2] {
        self.state_contacts().fold([0.0; 2], |[all, stored], (_, own)| {
            let k = own.coordinate;
            let before = from.map_or(0.0, |from| from[k]);
            let energy = 0.5 * own.mass * (to[k] + before) * (to[k] - before);
            let bristles = matches!(own.law, ContactState::Bristles(_));
            [all + energy, if bristles { stored + energy } else { stored }]
        })
    }

    /// The power of the inertia of hidden coordinates that store no energy, W.
    pub(crate) fn hidden_power(&self, u: &[f64], acceleration: &[f64]) -> f64 {
        let unstored = self.state_contacts().map(|(_, own)| own);
        let unstored = unstored.filter(|own| matches!(own.law, ContactState::Formulas(_)));
        let power =
            |own: &StateContact| own.mass * u[own.coordinate] * acceleration[own.coordinate];
        unstored.map(power).sum()
    }

    /// The same scene with the laws of the states of its contacts; that of a loop is another one.
    pub(crate) fn with_states(mut self, given: Vec<(usize, StateContact)>) -> Result<Self, Error> {
        if given.is_empty() {
            return Ok(self);
        }
        if let Some(reason) = self.refuses_states(&given) {
            return Err(Error::StateBeside { contact: given[0].0, reason });
        }
        let mut laws = vec![None; self.contacts.len()];
        for (contact, own) in &given {
            laws[*contact] = Some(own.law.law()?);
            let plane = self.contacts[*contact].plane.iter_mut();
            plane.for_each(|plane| plane.deflection = Some(own.coordinate));
        }
        self.laws = Some(laws.into());
        self.states = Some(given.into());
        self.check_elastic_planes()?;
        Ok(self)
    }

    /// The state of every contact by its law, 0 of one without; none where no contact has one.
    pub(crate) fn internal_states(&self, u: &[f64]) -> Vec<f64> {
        let all = || (0..self.contacts.len()).map(|contact| self.internal_state_of(contact));
        if all().all(|own| own.is_none()) {
            return Vec::new();
        }
        all().map(|own| own.map_or(0.0, |own| own.state_in(u))).collect()
    }

    /// What states of contacts are not computed beside, where the scene has such.
    fn refuses_states(&self, given: &[(usize, StateContact)]) -> Option<&'static str> {
        let opens = given.iter().any(|(_, own)| own.normal.is_some() && !own.law.is_spring());
        if opens && self.contacts_coupled() {
            return Some("a normal direction where mass couples contacts; lump the mass");
        }
        if opens && self.impact_friction {
            return Some("impact_friction");
        }
        let massless =
            given.iter().any(|&(contact, _)| !self.contacts[contact].tangential_has_mass());
        if massless {
            return Some(
                "a slip without mass; give the dof mass, or leave tangential_stiffness out",
            );
        }
        self.refuses_moving_directions()
    }

    /// C and F with what the states of closed contacts bring, as it is in one state.
    pub(crate) fn with_states_in(
        &self,
        combination: &Combination,
        q: &[f64],
        u: &[f64],
    ) -> Option<(SparseMatrix, Vec<f64>)> {
        self.states.as_ref()?;
        let mut rows: Vec<Vec<(usize, f64)>> = vec![Vec::new(); self.size];
        let mut force = self.force.clone();
        for (contact, _) in self.state_contacts() {
            if !combination.statuses()[*contact].is_closed() {
                continue;
            }
            let own = self.of_state(*contact, combination, q, u)?;
            own.damping
                .into_iter()
                .for_each(|(row, column, entry)| rows[row].push((column, entry)));
            own.force.into_iter().for_each(|(row, part)| force[row] += part);
        }
        Some((self.damping.combined(1.0, &of_entries(rows), 1.0), force))
    }

    /// The scene without the terms of states, which a spring holds at zero: statics, in which the friction of steady slip is
    /// constant.
    pub(crate) fn without_states(&self) -> Self {
        let (mut damping, mut springs) = (vec![Vec::new(); self.size], vec![Vec::new(); self.size]);
        let mut force = self.force.clone();
        for (contact, own) in self.state_contacts() {
            let slider_speed = self.contacts[*contact].slider_speed;
            for (row, column, entry) in own.linear_terms() {
                damping[row].push((column, -entry));
                if column == own.tangential {
                    force[row] -= entry * slider_speed;
                }
            }
            springs[own.coordinate].push((own.coordinate, own.mass));
        }
        Self {
            states: None,
            damping: self.damping.combined(1.0, &of_entries(damping), 1.0),
            stiffness: self.stiffness.combined(1.0, &of_entries(springs), 1.0),
            proportional: None,
            force,
            ..self.clone()
        }
    }

    /// A scene of small motions about steady sliding of this one, with the states of its closed contacts, from their normal forces.
    pub(crate) fn with_states_about(
        &self,
        combination: &Combination,
        mut steady: Self,
        pressed: &[f64],
    ) -> Self {
        let (mut damping, mut places) = (vec![Vec::new(); self.size], vec![Vec::new(); self.size]);
        for (contact, own) in self.state_contacts() {
            let Some(law) = self.friction_law(*contact) else { continue };
            let status = combination.statuses()[*contact];
            if !status.is_closed() {
                continue;
            }
            let normal_force = || match own.normal {
                // Springs of nodes that all rest need none.
                Some(_) => pressed.get(*contact).copied().unwrap_or(0.0),
                None => own.normal_force,
            };
            let slip = -self.contacts[*contact].slider_speed;
            let [rates, springs] = match self.elastic_plane(*contact) {
                Some(plane) => plane.tangents(*contact, status, normal_force()),
                None => own.tangents(law, slip, normal_force()),
            };
            rates.into_iter().for_each(|(row, column, entry)| damping[row].push((column, entry)));
            springs.into_iter().for_each(|(row, column, entry)| places[row].push((column, entry)));
            // In place of the spring that held the state.
            places[own.coordinate].push((own.coordinate, -own.mass));
        }
        steady.damping = steady.damping.combined(1.0, &of_entries(damping), 1.0);
        steady.stiffness = steady.stiffness.combined(1.0, &of_entries(places), 1.0);
        steady.mass = SparseMatrix::from_rows(self.size, |row, entries| {
            entries.extend(steady.mass.row(row).filter(|_| !self.is_hidden(row)));
        });
        steady.proportional = None;
        steady
    }
}

fn of_entries(mut rows: Vec<Vec<(usize, f64)>>) -> SparseMatrix {
    SparseMatrix::from_rows(rows.len(), |row, entries| {
        entries.append(&mut rows[row]);
        summed(entries);
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use crate::linalg::SparseMatrix;
    use crate::motion::method::Method;
    use crate::motion::propagators::Propagators;
    use crate::scene::model::State;
    use crate::scene::status::Combination;
    use crate::scene::{
        Bristles, ContactInput, ContactState, Damping, Direction, Mass, Scene, SceneInput,
    };
    use crate::transient::run_state::Controls;
    use crate::transient::simulate::simulate;

    fn scene(bristles: Bristles, speed: f64, stiffness: f64) -> Arc<Propagators> {
        let contact = ContactInput {
            tangential: Some(Direction::Dof(0)),
            normal_force: 1.0,
            slider_speed: speed,
            state: Some(ContactState::Bristles(bristles)),
            ..Default::default()
        };
        let input = SceneInput {
            mass: Mass::Lumped(vec![1.0]),
            stiffness: SparseMatrix::diagonal(&[stiffness]),
            damping: Damping::Proportional { mass: 0.0, stiffness: 0.0 },
            force: vec![0.0],
            contacts: vec![contact],
            ..Default::default()
        };
        Arc::new(Propagators::new(Arc::new(Scene::new(input).expect("well-posed"))))
    }

    /// The canonical set of LuGre, dragged at 0.1 m/s: times at which the mass turns, from other programs.
    #[test]
    fn stick_and_slip_of_the_canonical_set() {
        let bristles = Bristles {
            stiffness: 1e5,
            damping: 1e5f64.sqrt(),
            viscous: 0.4,
            kinetic: 1.0,
            at_rest: 1.5,
            speed: 1e-3,
            hysteresis: None,
        };
        let propagators = scene(bristles, -0.1, 2.0);
        let start = State {
            position: vec![0.0],
            velocity: vec![-0.1],
            combination: Combination::parse("-", 1).expect("one letter"),
            friction_force: Vec::new(),
            internal: Vec::new(),
        };
        let run = simulate(&propagators, &start, 11.0, Method::Auto, Controls::default());
        let run = run.expect("a run");
        let times: Vec<f64> = run.events.iter().map(|event| event.time).collect();
        let known = [10.2660909412841, 10.2764203978014, 10.2926632434272, 10.3009597155445];
        assert_eq!(times.len(), known.len());
        for (time, known) in times.iter().zip(known) {
            assert!((time - known).abs() < 1e-12, "{time} {known}");
        }
    }
}
