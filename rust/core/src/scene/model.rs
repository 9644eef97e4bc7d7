//! A mechanical model with frictional unilateral contacts, validated once.

use std::borrow::Cow;
use std::sync::Arc;

use crate::error::input::Error;
use crate::linalg::dense::max_norm;
use crate::linalg::sparse::SparseMatrix;
use crate::scene::contact_law::{Contact, ContactInput, Directions, Springs};
use crate::scene::coordinates::contact_coordinates::Coordinates;
use crate::scene::dependent::slaved_coordinates::SlavedCoordinates;
use crate::scene::elements::element::Element;
use crate::scene::friction::contact_state::StateContact;
use crate::scene::friction::law::FrictionLaw;
use crate::scene::inertia::border::Terms;
use crate::scene::inertia::coupled_mass::{CoupledMass, coupled_mass, uncoupled_mass};
use crate::scene::input::scene_input::SceneInput;
use crate::scene::input::validated::{HiddenDof, Validated};
use crate::scene::input::with_nodes::with_nodes;
use crate::scene::linear_terms::{EnergyParts, LinearTerms};
use crate::scene::loads::input::Loads;
use crate::scene::loads::oscillators::Drive;
use crate::scene::massless::coordinates::{Massless, Nodes, check_massless};
use crate::scene::status::{Combination, Status};

/// `M x'' + (C + G) x' + (K + H) x = F + sum_i (n_i N_i + t_i T_i)`, kept in contact coordinates q: the coordinate
/// `contacts[i].normal` is the gap of contact i less its clearance, and the velocity of `contacts[i].tangential` less the
/// slider speed its slip.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Contact coordinates: one for each dof, one for each node of a compliant contact, and one for each direction that
    /// a contact lacks or that depends on others.
    pub(crate) size: usize,
    /// Dofs as the user numbers them.
    pub(crate) dofs: usize,
    /// Nodes of compliant contacts.
    pub(crate) nodes: Option<Arc<Nodes>>,
    /// Coordinates without mass.
    pub(crate) massless: Massless,
    /// Whether those that follow the others are eliminated; see [`crate::scene::massless::condensation`].
    pub(crate) condensed: bool,
    /// Coordinates that follow others: sums of these where directions of contacts depend on each other, or without mass once
    /// the scene is condensed.
    pub(crate) dependents: SlavedCoordinates,
    pub(crate) contacts: Vec<Contact>,
    /// How friction depends on slip speed, by contact; `friction` of a contact is then its law at rest.
    pub(crate) laws: Option<Arc<[Option<FrictionLaw>]>>,
    /// Contacts with states; the laws of bristles are then h.
    pub(crate) states: Option<Arc<[(usize, StateContact)]>>,
    /// Springs and dampers that are no linear terms, and what all elements add to `force`.
    pub(crate) elements: Option<Arc<[Element]>>,
    pub(crate) preload: Option<Arc<[f64]>>,
    pub(crate) impact_friction: bool,
    pub(crate) coordinates: Coordinates,
    /// M in contact coordinates.
    pub(crate) mass: SparseMatrix,
    /// Factor and norm of M. None if M is diagonal and the stiffness is no arrow matrix; norms are then the largest entry.
    pub(crate) coupled_mass: Option<Arc<CoupledMass>>,
    /// C + G.
    pub(crate) damping: SparseMatrix,
    /// (alpha, beta) of C + G = alpha M + beta (K + H), when the user said so or the matrix is so to the last bit.
    pub(crate) proportional: Option<(f64, f64)>,
    /// K + H.
    pub(crate) stiffness: SparseMatrix,
    /// Present only in scenes with G or H.
    pub(crate) energy_parts: Option<EnergyParts>,
    /// F in contact coordinates.
    pub(crate) force: Vec<f64>,
    /// Loads in time that no coordinate carries yet; `force` holds the first values of switched ones.
    pub(crate) loads: Loads,
    /// Of a scene in which coordinates carry loads: these coordinates, and the scene without them.
    pub(crate) drive: Option<Drive>,
    pub(crate) bare: Option<Arc<Scene>>,
}

/// Dofs from which rest and modes have coordinates of their own; below, those of motions cost less than a second set.
const LARGE: usize = 500;

/// Where the system is, and what its contacts do; x and x' over the dofs of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// x, n entries, m.
    pub position: Vec<f64>,
    /// x', n entries, m/s.
    pub velocity: Vec<f64>,
    /// Status of every contact.
    pub combination: Combination,
    /// T of every contact, N, or empty for zero: the friction force that a sticking compliant contact holds, or the spring of a
    /// contact in a plane. In every other case T
    /// follows from the state.
    pub friction_force: Vec<f64>,
    /// The state z of every contact, 0 of one without, or empty for that of steady slip at the slip velocity.
    pub internal: Vec<f64>,
}

/// The size of a normal force: what holds the gap closed while all else is at zero, of a node that of the body that its spring ties it
/// to; where no load acts there, the largest load.
fn pressing(law: &Contact, stiffness: &SparseMatrix, force: &[f64]) -> f64 {
    let row = law.normal;
    let own = stiffness.get(row, row);
    let others = stiffness.row(row).filter(|&(k, _)| !law.normal_has_mass() && k != row);
    let carried: f64 = others.map(|(k, value)| -value / own * force[k]).sum();
    let held = (own * law.closed() - force[row] - carried).abs();
    if held > 0.0 { held } else { max_norm(force) }
}

impl Scene {
    /// Validates the input and takes it to contact coordinates.
    pub fn new(input: SceneInput) -> Result<Self, Error> {
        let dofs = input.force.len();
        let stated = Validated::new(input)?;
        let law = stated.damping.proportional();
        let (nodes, stated) = with_nodes(stated)?;
        let coordinates = Coordinates::new(&stated.mass, &stated.contacts)?;
        Self::in_coordinates(coordinates, (nodes, stated), (dofs, law))
    }

    /// A large scene in coordinates that leave its matrices sparse, for rest and modes alone. None of a small one, where directions
    /// of contacts depend on each other or all are along dofs, and where some dofs or compliant contacts lack mass.
    pub fn in_sparse_coordinates(input: &SceneInput) -> Result<Option<Self>, Error> {
        let dofs = input.force.len();
        let compliant = |law: &ContactInput| {
            let Springs { normal, tangential } = law.springs;
            normal.is_some() || tangential.is_some() || law.state.is_some()
        };
        if dofs < LARGE || input.contacts.iter().any(compliant) {
            return Ok(None);
        }
        let stated = Validated::new(input.clone())?;
        if (0..dofs).any(|dof| stated.lacks_mass(dof)) {
            return Ok(None);
        }
        let law = stated.damping.proportional();
        let Some(coordinates) = Coordinates::sparse(dofs, &stated.contacts) else {
            return Ok(None);
        };
        Self::in_coordinates(coordinates, with_nodes(stated)?, (dofs, law)).map(Some)
    }

    fn in_coordinates(
        coordinates: Coordinates,
        (nodes, stated): (Nodes, Validated),
        (dofs, law): (usize, Option<(f64, f64)>),
    ) -> Result<Self, Error> {
        let mass = uncoupled_mass(coordinates.congruent(stated.mass), &coordinates);
        let mut contacts: Vec<Contact> = stated
            .contacts
            .iter()
            .zip(&coordinates.slots)
            .map(|(law, &slots)| {
                law.in_coordinates(slots, |k| k >= nodes.size || mass.get(k, k) != 0.0)
            })
            .collect();
        check_massless(&contacts, &coordinates)?;
        let mut force = coordinates.forces_of_dofs(&stated.force);
        for (contact, law) in contacts.iter().zip(&stated.contacts) {
            if contact.directions == Directions::Tangential && !law.shares_normal(&stated.contacts)
            {
                force[contact.normal] = -law.normal_force;
            }
        }
        let matrices = (stated.stiffness, stated.damping);
        let LinearTerms { damping, stiffness, proportional, energy_parts } = LinearTerms::new(
            &coordinates,
            &mass,
            matrices,
            [stated.gyroscopic, stated.circulatory],
        );
        let massless = Massless::new(&mass, &stiffness, &contacts, nodes.size)?;
        if !massless.is_empty() && !mass.is_diagonal() {
            return Err(Error::shape(
                "mass",
                "a diagonal one, as by Body.lumped() or fe.reduce(boundary='massless'), since some dofs have none or contacts are compliant",
                "a mass that couples dofs".into(),
            ));
        }
        let felt = law.filter(|_| !massless.is_empty() && energy_parts.is_none());
        let border = Terms {
            proportional: proportional.or(felt),
            structure: mass.size(),
            massless: &massless,
        };
        let coupled_mass = match coordinates.decoupled {
            true => coupled_mass(&mass, &damping, &stiffness, Some(border), &coordinates.slots)?,
            false => None,
        };
        let dependents = coordinates.dependents.clone();
        if !dependents.is_empty() && !massless.is_empty() {
            return Err(Error::DependentBesideMassless);
        }
        let mut states = Vec::with_capacity(stated.hidden.len());
        for HiddenDof { contact, dof, mass } in stated.hidden {
            let law = &mut contacts[contact];
            let Some(state) = &stated.contacts[contact].state else { continue };
            let opens = law.opens() || stated.contacts[contact].shares_normal(&stated.contacts);
            law.hidden = opens.then_some(dof);
            let normal_force = match state.is_spring() {
                true => stated.contacts[contact].normal_force,
                false => pressing(law, &stiffness, &force),
            };
            let own = StateContact::new(
                state,
                (law.tangential, law.slider_speed),
                (dof, mass),
                (opens.then_some(law.normal), normal_force),
            )?;
            states.push((contact, own));
        }
        let preload =
            (!states.is_empty()).then(|| coordinates.forces_of_dofs(&stated.hidden_force).into());
        let scene = Self {
            size: coordinates.size(),
            dofs,
            nodes: (!nodes.is_empty()).then(|| Arc::new(nodes)),
            massless,
            condensed: false,
            dependents,
            contacts,
            laws: None,
            states: None,
            elements: None,
            preload,
            impact_friction: stated.impact_friction,
            coordinates,
            mass,
            coupled_mass,
            damping,
            proportional,
            stiffness,
            energy_parts,
            force,
            loads: stated.loads,
            drive: None,
            bare: None,
        };
        scene.with_planes(&stated.contacts)?.with_states(states)
    }

    /// Number of contact coordinates without those that carry loads.
    pub(crate) fn structure(&self) -> usize {
        self.drive.as_ref().map_or(self.size, |drive| drive.structure)
    }

    /// (alpha, beta) of a damping that is proportional to mass and to what is felt of K while no contact acts on coordinates
    /// without mass, where these are known.
    pub(crate) fn felt(&self) -> Option<(f64, f64)> {
        let bare = self.bare();
        let border = || bare.coupled_mass.as_ref()?.border.as_ref()?.proportional;
        bare.proportional.or_else(border)
    }

    /// The same without coordinates that carry loads.
    pub(crate) fn bare(&self) -> &Self {
        self.bare.as_deref().unwrap_or(self)
    }

    /// The common period of the loads that oscillate, s; None without any.
    pub(crate) fn load_period(&self) -> Result<Option<f64>, Error> {
        self.drive.as_ref().and_then(Drive::period).transpose()
    }

    /// The fastest rate of a load, 1/s; 1 without any.
    pub(crate) fn fastest_load(&self) -> f64 {
        let rates = self.drive.iter().flat_map(|drive| &drive.oscillators).map(|one| one.rate);
        rates.reduce(f64::max).unwrap_or(1.0)
    }

    /// Whether an entry of (q, q') belongs to the structure, and not to what carries its loads.
    pub(crate) fn is_structure(&self, entry: usize) -> bool {
        entry % self.size < self.structure()
    }

    /// The first time after `time` at which a load is switched.
    pub(crate) fn next_switch(&self, time: f64) -> Option<f64> {
        self.drive.as_ref().and_then(|drive| drive.next_switch(time))
    }

    /// (q, q') of the structure, from where sliders that vibrate do not carry it.
    pub(crate) fn at_rest<'a>(
        &self,
        q: &'a [f64],
        u: &'a [f64],
    ) -> (Cow<'a, [f64]>, Cow<'a, [f64]>) {
        match &self.drive {
            Some(drive) => drive.at_rest(q, u),
            None => (Cow::Borrowed(q), Cow::Borrowed(u)),
        }
    }

    /// Positions and velocities of the dofs.
    pub(crate) fn dof_state(&self, q: &[f64], u: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (q, u) = self.at_rest(q, u);
        (self.positions(&q), self.velocities(&u))
    }

    /// A time after which no load is switched, and at which the oscillating loads have the phase with which they begin.
    pub(crate) fn after_switches(&self) -> Result<f64, Error> {
        let switches = self.drive.iter().flat_map(|drive| &drive.switches);
        let last = switches.filter_map(|switch| switch.times.last().copied()).fold(0.0, f64::max);
        Ok(self.load_period()?.map_or(last, |period| (last / period).ceil() * period))
    }

    /// Accelerations of the dofs, from (q', q'').
    pub(crate) fn accelerations(&self, field: &[f64]) -> Vec<f64> {
        let (u, acceleration) = field.split_at(self.size);
        self.velocities(&self.at_rest(u, acceleration).1)
    }

    /// Contact coordinates (q, q') of dof positions and velocities at a time, with what carries the loads.
    pub(crate) fn moving_coordinates(
        &self,
        position: &[f64],
        velocity: &[f64],
        time: f64,
    ) -> (Vec<f64>, Vec<f64>) {
        let (q, u) = self.to_coordinates(position, velocity);
        match &self.drive {
            Some(drive) => drive.extended(q, u, time),
            None => (q, u),
        }
    }

    /// M, C + G and K + H in contact coordinates.
    pub(crate) fn matrices(&self) -> [&SparseMatrix; 3] {
        [&self.mass, &self.damping, &self.stiffness]
    }

    /// Number of dofs.
    pub fn dofs(&self) -> usize {
        self.dofs
    }

    /// The contacts in contact coordinates, in the order in which they were given.
    pub fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    /// Whether some dofs or compliant contacts have no mass.
    pub fn has_massless(&self) -> bool {
        !self.massless.is_empty()
    }

    /// Whether directions of contacts depend on each other.
    pub fn has_dependent_directions(&self) -> bool {
        !self.condensed && !self.dependents.is_empty()
    }

    /// Whether mass couples the directions of contacts or these depend on each other, so that their transitions depend on
    /// each other.
    pub fn contacts_coupled(&self) -> bool {
        self.coordinates.delassus.is_some()
    }

    /// Whether impulses have friction: where they are oblique, in any case, as small motions have it there.
    pub fn impacts_rub(&self) -> bool {
        self.impact_friction || self.coordinates.oblique
    }

    /// The force that holds contact coordinate `row` in state (q, q') when all others are held too,
    /// `(K q + C q' - F)_row`.
    pub(crate) fn reaction_value(&self, row: usize, q: &[f64], u: &[f64]) -> f64 {
        self.stiffness.row_dot(row, q) + self.damping.row_dot(row, u) - self.force[row]
    }

    /// `P = M^-1 D (D' M^-1 D)^-1` by columns, (tangential, normal) of each contact, with D its directions: `P' r` are the
    /// contact forces f that add up to a load `r = D f`.
    pub fn contact_basis(&self) -> Vec<Vec<f64>> {
        // Both directions of a plane share one normal force, which counts once.
        let normal = |law: &Contact| if law.shares_normal() { self.size } else { law.normal };
        let slots = self.contacts.iter().flat_map(|law| [law.tangential, normal(law)]);
        slots.map(|slot| self.over_dofs(self.coordinates.column(slot, self.size))).collect()
    }

    /// Contact coordinates (q, q') of dof positions and velocities.
    pub(crate) fn to_coordinates(
        &self,
        position: &[f64],
        velocity: &[f64],
    ) -> (Vec<f64>, Vec<f64>) {
        let of = |x: &[f64]| match &self.nodes {
            Some(nodes) => self.coordinates.of_dofs(&nodes.extended(x)),
            None => self.coordinates.of_dofs(x),
        };
        (of(position), of(velocity))
    }

    /// A vector over the dofs, without the nodes of compliant contacts.
    fn over_dofs(&self, mut x: Vec<f64>) -> Vec<f64> {
        x.truncate(self.dofs);
        x
    }

    /// Dof positions of contact coordinates.
    pub(crate) fn positions(&self, q: &[f64]) -> Vec<f64> {
        self.over_dofs(self.coordinates.to_dofs(q))
    }

    /// Dof velocities of contact coordinates; also any other displacement difference or mode shape.
    pub(crate) fn velocities(&self, u: &[f64]) -> Vec<f64> {
        self.over_dofs(self.coordinates.to_dofs(u))
    }

    /// The state of contact coordinates.
    pub(crate) fn state(&self, q: &[f64], u: &[f64], combination: &Combination) -> State {
        let held = |(contact, (law, &status)): (usize, (&Contact, &Status))| {
            if let Some(own) = self.state_of(contact).filter(|_| law.is_elastic()) {
                return -own.spring() * own.state_in(u);
            }
            let creeps = status.is_sliding() && self.creeps(contact);
            let holds = (status == Status::Sticking || creeps) && law.tangential >= self.dofs;
            if holds { self.reaction_value(law.tangential, q, u) } else { 0.0 }
        };
        let laws = self.contacts.iter().zip(combination.statuses()).enumerate();
        let forces = || laws.map(held).collect();
        let (position, velocity) = self.dof_state(q, u);
        State {
            position,
            velocity,
            combination: combination.clone(),
            friction_force: self.nodes.as_ref().map_or_else(Vec::new, |_| forces()),
            internal: self.internal_states(u),
        }
    }

    /// Refuses a combination in which a frictionless contact sticks, or a contact has a status for which it lacks a
    /// direction.
    pub fn check_combination(&self, combination: &Combination) -> Result<(), Error> {
        let contacts = self.contacts.len();
        if combination.statuses().len() != contacts {
            return Err(Error::Combination { got: combination.to_string(), contacts });
        }
        for (contact, (law, &status)) in
            self.contacts.iter().zip(combination.statuses()).enumerate()
        {
            if let Some(plane) = law.plane
                && (!law.admits(status) || combination.statuses()[plane.beside] != status)
            {
                let (beside, combination) = (plane.beside, combination.to_string());
                return Err(Error::PlaneStatuses { contact, beside, combination });
            }
            if !law.admits(status) {
                let (direction, expected) = match law.directions {
                    Directions::Both => ("second tangential", "'+', '-', 's' or 'd'"),
                    Directions::Normal => ("tangential", "'+' (closed) or 'd'"),
                    _ => ("normal", "'+', '-' or 's'"),
                };
                let combination = combination.to_string();
                let status = status.letter();
                return Err(Error::InadmissibleStatus {
                    contact,
                    direction,
                    expected,
                    status,
                    combination,
                });
            }
            if status == Status::Sticking && law.static_friction == 0.0 {
                return Err(Error::FrictionlessStick {
                    contact,
                    combination: combination.to_string(),
                });
            }
        }
        Ok(())
    }
}
