//! A mechanical model with frictional unilateral contacts, validated once.

use std::borrow::Cow;
use std::sync::Arc;

use crate::error::Error;
use crate::linalg::sparse::SparseMatrix;
use crate::scene::contact_law::{Contact, Directions, Inertia};
use crate::scene::coordinates::contact_coordinates::Coordinates;
use crate::scene::dependent::sums::{Dependent, dependents_of};
use crate::scene::friction::law::FrictionLaw;
use crate::scene::inertia::coupled_mass::CoupledMass;
use crate::scene::input::proportions::proportions;
use crate::scene::input::scene_input::{Damping, SceneInput};
use crate::scene::input::validated::{Validated, unfit};
use crate::scene::loads::input::Loads;
use crate::scene::loads::oscillators::Drive;
use crate::scene::massless::coordinates::{Massless, Nodes, condensed_stiffness};
use crate::scene::status::{Combination, Status};

/// `M x'' + (C + G) x' + (K + H) x = F + sum_i (n_i N_i + t_i T_i)`, kept in contact coordinates q, where the
/// gap of contact i is the coordinate `contacts[i].normal` and its slip the velocity of
/// `contacts[i].tangential` less the slider speed.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Contact coordinates: one for each dof, one for each node of a compliant contact, and one for each direction that
    /// a contact has not or that depends on others.
    pub(crate) size: usize,
    /// Dofs as the user numbers them.
    pub(crate) dofs: usize,
    /// Of compliant contacts.
    pub(crate) nodes: Option<Arc<Nodes>>,
    /// Coordinates without mass.
    pub(crate) massless: Massless,
    /// Whether those that follow the others are eliminated; see [`crate::scene::massless::condensation`].
    pub(crate) condensed: bool,
    /// Coordinates that are sums of others, because directions of contacts depend on each other.
    pub(crate) dependents: Vec<Dependent>,
    pub(crate) contacts: Vec<Contact>,
    /// How friction depends on slip speed, by contact; `friction` of a contact is then its law at rest.
    pub(crate) laws: Option<Arc<[Option<FrictionLaw>]>>,
    pub(crate) impact_friction: bool,
    pub(crate) coordinates: Coordinates,
    /// M in contact coordinates.
    pub(crate) mass: SparseMatrix,
    /// What is known of that M, unless it is diagonal.
    pub(crate) coupled_mass: Option<Arc<CoupledMass>>,
    /// C + G.
    pub(crate) damping: SparseMatrix,
    /// (alpha, beta) of C + G = alpha M + beta (K + H), when the user said so or the matrix is so to the last bit.
    pub(crate) proportional: Option<(f64, f64)>,
    /// K + H.
    pub(crate) stiffness: SparseMatrix,
    /// Of scenes with G or H alone.
    pub(crate) energy_parts: Option<EnergyParts>,
    /// F in contact coordinates, with the clearances' part `K q_gap` added.
    pub(crate) force: Vec<f64>,
    /// Loads in time that no coordinate carries yet; `force` holds the first values of switched ones.
    pub(crate) loads: Loads,
    /// Of a scene in which coordinates carry loads: these coordinates, and the scene without them.
    pub(crate) drive: Option<Drive>,
    pub(crate) bare: Option<Arc<Scene>>,
}

/// What the motion does not tell apart, but its energy does.
#[derive(Debug, Clone)]
pub(crate) struct EnergyParts {
    /// C, which dissipates.
    pub dissipative: SparseMatrix,
    /// `K + (H + H') / 2`, which stores.
    pub elastic: SparseMatrix,
    /// `H_a = (H - H') / 2`, whose power `-u' H_a x` is neither stored nor dissipated.
    pub antisymmetric: SparseMatrix,
}

/// Where the system is, and what its contacts do; x and x' over the dofs of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// x, n entries, m.
    pub position: Vec<f64>,
    /// x', n entries, m/s.
    pub velocity: Vec<f64>,
    /// Status of every contact.
    pub combination: Combination,
    /// T of every contact, N, or empty for none: what a compliant contact that sticks holds. In every other case T follows
    /// from the state.
    pub friction_force: Vec<f64>,
}

impl Scene {
    /// Validates the input and takes it to contact coordinates.
    pub fn new(input: SceneInput) -> Result<Self, Error> {
        let Validated {
            mass,
            stiffness,
            damping,
            gyroscopic,
            circulatory,
            mut force,
            contacts: inputs,
            impact_friction,
            loads,
        } = Validated::new(input)?;
        let dofs = force.len();
        let nodes = Nodes::new(dofs, &inputs);
        let size = nodes.size;
        let lacks = |dof: &usize| mass.get(*dof, *dof) == 0.0;
        let massless = (0..dofs).any(|dof| lacks(&dof));
        let damping = match damping {
            Damping::Proportional { mass: alpha, stiffness: beta }
                if beta != 0.0 && (massless || !nodes.is_empty()) =>
            {
                let felt = condensed_stiffness(&mass, &stiffness)?;
                Damping::General(mass.combined(alpha, &felt, beta))
            }
            damping => damping,
        };
        if massless {
            let given = match &damping {
                Damping::General(damping) => Some(damping),
                Damping::Proportional { .. } => None,
            };
            let rates = [
                ("damping", given),
                ("gyroscopic", gyroscopic.as_ref()),
                ("circulatory", circulatory.as_ref()),
            ];
            for (argument, matrix) in rates {
                let touches = |matrix: &SparseMatrix, dof: usize| {
                    matrix.row(dof).any(|(k, value)| value != 0.0 && (lacks(&dof) || lacks(&k)))
                };
                let found = matrix.and_then(|matrix| (0..dofs).find(|&dof| touches(matrix, dof)));
                if let Some(row) = found {
                    let column = |matrix: &SparseMatrix| {
                        matrix.row(row).map(|entry| entry.0).find(|k| lacks(k))
                    };
                    let dof =
                        if lacks(&row) { row } else { matrix.and_then(column).unwrap_or(row) };
                    return Err(Error::RateWithoutMass { argument, dof });
                }
            }
        }
        let laws = nodes.contacts(&inputs);
        let mass = nodes.padded(mass);
        let stiffness = nodes.with_springs(stiffness);
        let damping = match damping {
            Damping::General(damping) => Damping::General(nodes.padded(damping)),
            proportional => proportional,
        };
        let gyroscopic = gyroscopic.map(|matrix| nodes.padded(matrix));
        let circulatory = circulatory.map(|matrix| nodes.padded(matrix));
        force.resize(size, 0.0);

        let coordinates = Coordinates::new(&mass, &laws)?;
        let mass = uncoupled_mass(coordinates.congruent(mass), &coordinates);
        let contacts: Vec<Contact> = laws
            .iter()
            .zip(&coordinates.slots)
            .map(|(law, &(tangential, normal))| Contact {
                directions: law.directions(),
                inertia: law.inertia(
                    tangential < size && mass.get(tangential, tangential) == 0.0,
                    normal < size && mass.get(normal, normal) == 0.0,
                ),
                tangential,
                normal,
                friction: law.friction,
                static_friction: law.static_friction,
                slider_speed: law.slider_speed,
                restitution: law.restitution,
                gap: law.gap,
            })
            .collect();
        check_massless(&contacts, &coordinates)?;
        let (known, size) = (size, coordinates.size());
        let (rotating, following) = (gyroscopic.is_some(), circulatory.is_some());
        let symmetric_stiffness = coordinates.congruent(stiffness);
        let (symmetric_damping, law) = match damping {
            Damping::General(damping) => (coordinates.congruent(damping), None),
            Damping::Proportional { mass: alpha, stiffness: beta } => {
                (mass.combined(alpha, &symmetric_stiffness, beta), Some((alpha, beta)))
            }
        };
        let (damping, stiffness, energy_parts) = if rotating || following {
            let [g, h] = [gyroscopic, circulatory].map(|given| match given {
                Some(matrix) => coordinates.transformed(matrix),
                None => SparseMatrix::from_rows(size, |_, _| ()),
            });
            let [symmetric, antisymmetric] = h.parts();
            let parts = EnergyParts {
                elastic: symmetric_stiffness.combined(1.0, &symmetric, 1.0),
                antisymmetric,
                dissipative: symmetric_damping,
            };
            let damping = parts.dissipative.combined(1.0, &g, 1.0);
            (damping, symmetric_stiffness.combined(1.0, &h, 1.0), Some(parts))
        } else {
            (symmetric_damping, symmetric_stiffness, None)
        };
        let proportional = match law {
            // With G, or with H beside beta K, the law of C is not that of C + G.
            Some((_, beta)) if !rotating && (!following || beta == 0.0) => law,
            _ => proportions(&damping, &mass, &stiffness),
        };
        let massless = Massless::new(&mass, &stiffness, &contacts, known)?;
        if !massless.is_empty() && !mass.is_diagonal() {
            return Err(unfit(
                "mass",
                "a diagonal one, as some dofs have none or contacts are compliant",
                "a mass that couples dofs".into(),
            ));
        }
        let coupled_mass = coupled_mass(&mass, &damping, &stiffness, &coordinates.slots)?;
        let mut force = coordinates.forces_of_dofs(&force);
        for (contact, law) in contacts.iter().zip(&inputs) {
            if contact.directions == Directions::Tangential {
                force[contact.normal] = -law.normal_force;
            }
        }
        if contacts.iter().any(|contact| contact.gap != 0.0) {
            let mut clearance = vec![0.0; size];
            for contact in &contacts {
                clearance[contact.normal] = contact.gap;
            }
            stiffness.add_product(1.0, &clearance, &mut force);
        }
        let dependents = dependents_of(&coordinates, &contacts);
        if !dependents.is_empty() && !massless.is_empty() {
            return Err(Error::DependentBesideMassless);
        }
        Ok(Self {
            size,
            dofs,
            nodes: (!nodes.is_empty()).then(|| Arc::new(nodes)),
            massless,
            condensed: false,
            dependents,
            contacts,
            laws: None,
            impact_friction,
            coordinates,
            mass,
            coupled_mass,
            damping,
            proportional,
            stiffness,
            energy_parts,
            force,
            loads,
            drive: None,
            bare: None,
        })
    }

    /// Number of contact coordinates without those that carry loads.
    pub(crate) fn structure(&self) -> usize {
        self.drive.as_ref().map_or(self.size, |drive| drive.structure)
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

    /// A time from which on no load is switched, at which those that oscillate have the phase that they begin with.
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
        !self.dependents.is_empty()
    }

    /// Whether mass couples the directions of contacts or these depend on each other, so that their transitions depend on
    /// each other.
    pub fn contacts_coupled(&self) -> bool {
        self.coordinates.delassus.is_some()
    }

    /// The force that holds contact coordinate `row` in state (q, q') when all others are held too,
    /// `(K q + C q' - F)_row`.
    pub(crate) fn reaction_value(&self, row: usize, q: &[f64], u: &[f64]) -> f64 {
        self.stiffness.row_dot(row, q) + self.damping.row_dot(row, u) - self.force[row]
    }

    /// `P = M^-1 D (D' M^-1 D)^-1` by columns, (tangential, normal) of each contact, with D its directions: `P' r` are the
    /// contact forces f that add up to a load `r = D f`.
    pub fn contact_basis(&self) -> Vec<Vec<f64>> {
        let slots = self.contacts.iter().flat_map(|law| [law.tangential, law.normal]);
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
        let mut q = of(position);
        for contact in &self.contacts {
            q[contact.normal] += contact.gap;
        }
        (q, of(velocity))
    }

    /// Without the nodes of compliant contacts.
    fn over_dofs(&self, mut x: Vec<f64>) -> Vec<f64> {
        x.truncate(self.dofs);
        x
    }

    /// Dof positions of contact coordinates.
    pub(crate) fn positions(&self, q: &[f64]) -> Vec<f64> {
        let mut unshifted = q.to_vec();
        for contact in &self.contacts {
            unshifted[contact.normal] -= contact.gap;
        }
        self.over_dofs(self.coordinates.to_dofs(&unshifted))
    }

    /// Dof velocities of contact coordinates; also any other displacement difference or mode shape.
    pub(crate) fn velocities(&self, u: &[f64]) -> Vec<f64> {
        self.over_dofs(self.coordinates.to_dofs(u))
    }

    /// The state of contact coordinates.
    pub(crate) fn state(&self, q: &[f64], u: &[f64], combination: &Combination) -> State {
        let held = |(law, &status): (&Contact, &Status)| {
            let sticks = status == Status::Sticking && law.tangential >= self.dofs;
            if sticks { self.reaction_value(law.tangential, q, u) } else { 0.0 }
        };
        let forces = || self.contacts.iter().zip(combination.statuses()).map(held).collect();
        let (position, velocity) = self.dof_state(q, u);
        State {
            position,
            velocity,
            combination: combination.clone(),
            friction_force: self.nodes.as_ref().map_or_else(Vec::new, |_| forces()),
        }
    }

    /// Refuses a combination in which a frictionless contact sticks, or a contact has a status for which it lacks a
    /// direction.
    pub fn check_combination(&self, combination: &Combination) -> Result<(), Error> {
        for (contact, (law, &status)) in
            self.contacts.iter().zip(combination.statuses()).enumerate()
        {
            if !law.directions.admit(status) {
                let (direction, expected) = match law.directions {
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

/// Refuses contacts of which only the gap has mass, that bounce without mass, or that have none beside others that mass
/// couples.
fn check_massless(contacts: &[Contact], coordinates: &Coordinates) -> Result<(), Error> {
    for (contact, law) in contacts.iter().enumerate() {
        if law.inertia == Inertia::Full {
            continue;
        }
        if law.inertia == Inertia::Normal {
            let reason = "its normal direction has mass and its tangential one has none; give both mass, or a normal_stiffness";
            return Err(Error::MixedMass { contact, reason });
        }
        if law.restitution != 0.0 {
            return Err(Error::RestitutionWithoutMass { contact, restitution: law.restitution });
        }
        if coordinates.delassus.is_some() {
            let reason = "it has no mass, and mass couples other contacts of the scene with each other; state a lumped mass";
            return Err(Error::MixedMass { contact, reason });
        }
    }
    Ok(())
}

/// What is known of a mass in contact coordinates that is not diagonal.
pub(crate) fn coupled_mass(
    mass: &SparseMatrix,
    damping: &SparseMatrix,
    stiffness: &SparseMatrix,
    slots: &[(usize, usize)],
) -> Result<Option<Arc<CoupledMass>>, Error> {
    if mass.is_diagonal() {
        return Ok(None);
    }
    let known = CoupledMass::new(mass, damping, stiffness, slots);
    known.map(|known| Some(Arc::new(known))).map_err(|dof| Error::IndefiniteSparseMass { dof })
}

/// Without the couplings that are zero by construction of the coordinates, and nonzero by rounding.
fn uncoupled_mass(mass: SparseMatrix, coordinates: &Coordinates) -> SparseMatrix {
    if mass.is_diagonal() {
        return mass;
    }
    let mut is_contact = vec![false; mass.size()];
    for &(tangential, normal) in &coordinates.slots {
        (is_contact[tangential], is_contact[normal]) = (true, true);
    }
    mass.filtered(|i, j| match (is_contact[i], is_contact[j]) {
        (true, true) => i == j || coordinates.delassus.is_some(),
        (one, other) => one == other,
    })
}
