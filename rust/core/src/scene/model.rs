//! A mechanical model with frictional unilateral contacts, validated once.

use std::borrow::Cow;
use std::sync::Arc;

use nalgebra::DMatrix;

use crate::error::Error;
use crate::linalg::dense::{INDEFINITE, cholesky};
use crate::linalg::sparse::SparseMatrix;
use crate::linalg::sparse_factors::SparseCholesky;
use crate::scene::contact_coordinates::Coordinates;
use crate::scene::contact_law::{
    Contact, ContactInput, Direction, Directions, Inertia, check_finite,
};
use crate::scene::dependent::sums::{Dependent, dependents_of};
use crate::scene::inertia::coupled_mass::CoupledMass;
use crate::scene::loads::input::Loads;
use crate::scene::loads::oscillators::Drive;
use crate::scene::massless::coordinates::{Massless, Nodes, condensed_stiffness};
use crate::scene::status::{Combination, Status};

/// Mass as a user states it.
#[derive(Debug, Clone)]
pub enum Mass {
    /// Diagonal, kg; 0 where a dof has no mass.
    Lumped(Vec<f64>),
    /// Symmetric, positive definite over the dofs whose rows are not zero, kg.
    Full(DMatrix<f64>),
    /// The same by its nonzero entries, kg.
    Sparse(SparseMatrix),
}

/// Damping as a user states it.
#[derive(Debug, Clone)]
pub enum Damping {
    /// `C = mass M + stiffness K`.
    Proportional {
        /// alpha, 1/s, not negative.
        mass: f64,
        /// beta, s, not negative.
        stiffness: f64,
    },
    /// Any symmetric matrix, N s/m.
    General(SparseMatrix),
}

/// Everything a scene is made of.
#[derive(Debug, Clone)]
pub struct SceneInput {
    /// M, n by n, kg.
    pub mass: Mass,
    /// K, n by n, symmetric, N/m.
    pub stiffness: SparseMatrix,
    /// C, n by n, N s/m.
    pub damping: Damping,
    /// G, n by n, skew-symmetric, N s/m: forces of rotating parts, which do no work.
    pub gyroscopic: Option<SparseMatrix>,
    /// H, n by n, any matrix, N/m: forces that follow displacements without a potential, such as follower forces, or
    /// friction that another program put into its stiffness.
    pub circulatory: Option<SparseMatrix>,
    /// F, n entries, N, constant in time.
    pub force: Vec<f64>,
    /// The contacts, in the order of the letters of a combination.
    pub contacts: Vec<ContactInput>,
    /// Whether an impact has a Coulomb impulse too, at most friction times the normal one; else it leaves tangential velocities.
    pub impact_friction: bool,
    /// Loads that depend on time.
    pub loads: Loads,
}

impl SceneInput {
    /// M, C + G, K + H, `K + (H + H') / 2` and `(H - H') / 2` over the dofs.
    pub fn matrices(&self) -> [SparseMatrix; 5] {
        let mass = match &self.mass {
            Mass::Lumped(entries) => SparseMatrix::diagonal(entries),
            Mass::Full(dense) => SparseMatrix::from_dense(dense),
            Mass::Sparse(entries) => entries.clone(),
        };
        let damping = match &self.damping {
            Damping::Proportional { mass: alpha, stiffness: beta } => {
                let stiffness = condensed_stiffness(&mass, &self.stiffness);
                mass.combined(*alpha, stiffness.as_ref().unwrap_or(&self.stiffness), *beta)
            }
            Damping::General(damping) => damping.clone(),
        };
        let damping = match &self.gyroscopic {
            Some(gyroscopic) => damping.combined(1.0, gyroscopic, 1.0),
            None => damping,
        };
        let stiffness = self.stiffness.clone();
        let Some(h) = &self.circulatory else {
            let none = SparseMatrix::from_rows(mass.size(), |_, _| ());
            return [mass, damping, stiffness.clone(), stiffness, none];
        };
        let [symmetric, skew] = h.parts();
        let elastic = stiffness.combined(1.0, &symmetric, 1.0);
        [mass, damping, stiffness.combined(1.0, h, 1.0), elastic, skew]
    }

    /// D by columns: the tangential and the normal direction of every contact; zero where it has none.
    pub fn directions(&self) -> Vec<Vec<f64>> {
        let directions = self.contacts.iter().flat_map(|law| [&law.tangential, &law.normal]);
        directions
            .map(|direction| {
                let mut column = vec![0.0; self.force.len()];
                let entries = direction.iter().flat_map(Direction::nonzero);
                entries.for_each(|(dof, entry)| column[dof] = entry);
                column
            })
            .collect()
    }
}

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
        let size = match &input.mass {
            Mass::Lumped(mass) => mass.len(),
            Mass::Full(mass) => mass.nrows(),
            Mass::Sparse(mass) => mass.size(),
        };
        if size == 0 {
            return Err(unfit("mass", "at least one dof", "none".into()));
        }
        let mass = validated_mass(input.mass)?;
        let square = format!("shape ({size}, {size})");
        let check_size = |argument: &str, matrix: &SparseMatrix| {
            if matrix.size() == size {
                Ok(())
            } else {
                Err(unfit(argument, &square, format!("({0}, {0})", matrix.size())))
            }
        };
        check_size("stiffness", &input.stiffness)?;
        let stiffness = input.stiffness.validated_symmetric("stiffness")?;
        // A matrix of zeros is none.
        let present = |matrix: Option<SparseMatrix>| matrix.filter(|matrix| matrix.entries() > 0);
        let mut gyroscopic = present(input.gyroscopic);
        if let Some(matrix) = gyroscopic.take() {
            check_size("gyroscopic", &matrix)?;
            gyroscopic = Some(matrix.validated_skew("gyroscopic")?);
        }
        let circulatory = present(input.circulatory);
        if let Some(matrix) = &circulatory {
            check_size("circulatory", matrix)?;
            matrix.check_finite("circulatory")?;
        }
        let damping = match input.damping {
            Damping::Proportional { mass, stiffness } => {
                for (field, value) in [("damping.mass", mass), ("damping.stiffness", stiffness)] {
                    let requirement = if value.is_finite() { ">= 0" } else { "finite" };
                    if !(value.is_finite() && value >= 0.0) {
                        return Err(Error::Range { argument: field.into(), requirement, value });
                    }
                }
                Damping::Proportional { mass, stiffness }
            }
            Damping::General(damping) => {
                check_size("damping", &damping)?;
                Damping::General(damping.validated_symmetric("damping")?)
            }
        };
        if input.force.len() != size {
            let expected = format!("shape ({size},)");
            return Err(unfit("force", &expected, format!("({},)", input.force.len())));
        }
        check_finite("force", &input.force)?;
        for (contact, law) in input.contacts.iter().enumerate() {
            law.validate(contact, size)?;
        }
        input.loads.validate(size, input.contacts.len())?;
        let mut force = input.force;
        for load in &input.loads.steps {
            load.direction.iter().for_each(|&(dof, entry)| force[dof] += load.values[0] * entry);
        }

        let dofs = size;
        let nodes = Nodes::new(dofs, &input.contacts);
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
        let laws = nodes.contacts(&input.contacts);
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
        for (contact, law) in contacts.iter().zip(&input.contacts) {
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
            impact_friction: input.impact_friction,
            coordinates,
            mass,
            coupled_mass,
            damping,
            proportional,
            stiffness,
            energy_parts,
            force,
            loads: input.loads,
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

/// (alpha, beta) of a matrix that is `alpha M`, `beta K` or zero to the last bit. A matrix with both parts was rounded
/// when it was summed, and is taken as it is.
fn proportions(
    damping: &SparseMatrix,
    mass: &SparseMatrix,
    stiffness: &SparseMatrix,
) -> Option<(f64, f64)> {
    let size = damping.size();
    let entries = |matrix: &SparseMatrix, factor: f64| {
        let nonzero =
            |row| matrix.row(row).map(move |(column, value)| (row, column, factor * value));
        (0..size).flat_map(nonzero).filter(|entry| entry.2 != 0.0).collect::<Vec<_>>()
    };
    let given = entries(damping, 1.0);
    let Some(&(row, column, value)) = given.first() else { return Some((0.0, 0.0)) };
    let factor = |matrix: &SparseMatrix| {
        let factor = value / matrix.get(row, column);
        (factor > 0.0 && factor.is_finite() && entries(matrix, factor) == given).then_some(factor)
    };
    let by_mass = factor(mass).map(|alpha| (alpha, 0.0));
    by_mass.or_else(|| factor(stiffness).map(|beta| (0.0, beta)))
}

fn unfit(argument: &str, expected: &str, got: String) -> Error {
    Error::Shape { argument: argument.to_owned(), expected: expected.to_owned(), got }
}

/// The mass in compressed rows; positive definite by Cholesky pivots over the dofs that have any.
fn validated_mass(mass: Mass) -> Result<SparseMatrix, Error> {
    match mass {
        Mass::Lumped(mass) => {
            check_finite("mass", &mass)?;
            match mass.iter().position(|&entry| entry < 0.0) {
                Some(dof) => Err(Error::IndefiniteMass { dof, value: mass[dof] }),
                None => Ok(SparseMatrix::diagonal(&mass)),
            }
        }
        Mass::Full(mass) => {
            if !mass.is_square() {
                let (rows, columns) = mass.shape();
                return Err(unfit("mass", "shape (n,) or (n, n)", format!("({rows}, {columns})")));
            }
            let mass = SparseMatrix::from_dense(&mass).validated_symmetric("mass")?;
            let heavy: Vec<usize> =
                (0..mass.size()).filter(|&dof| mass.row(dof).any(|entry| entry.1 != 0.0)).collect();
            cholesky(&mass.restricted(&heavy).to_dense())
                .map_err(|(row, value)| Error::IndefiniteMass { dof: heavy[row], value })?;
            Ok(mass)
        }
        Mass::Sparse(mass) => {
            let mass = mass.validated_symmetric("mass")?;
            let entry = |dof: usize| mass.get(dof, dof);
            if let Some(dof) = (0..mass.size()).find(|&dof| !(entry(dof) > 0.0)) {
                return Err(Error::IndefiniteMass { dof, value: entry(dof) });
            }
            // Pivots that are no more than rounding of their diagonal entries are none.
            let least = mass.combined(1.0, &mass.diagonal_part(), -INDEFINITE);
            match SparseCholesky::new(&least) {
                Ok(_) => Ok(mass),
                Err(dof) => Err(Error::IndefiniteSparseMass { dof }),
            }
        }
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
