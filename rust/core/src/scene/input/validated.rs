//! The matrices and forces of a scene over its dofs, each with the shape and the property that it is to have.

use crate::error::input::Error;
use crate::linalg::dense::{INDEFINITE, cholesky};
use crate::linalg::sparse::SparseMatrix;
use crate::linalg::sparse_factors::SparseCholesky;
use crate::scene::contact_law::{ContactInput, check_finite, check_planes};
use crate::scene::input::elastic_planes::with_loops;
use crate::scene::input::scene_input::{Damping, Mass, SceneInput};
use crate::scene::loads::input::Loads;

/// What [`SceneInput`] states, checked.
pub(crate) struct Validated {
    pub mass: SparseMatrix,
    pub stiffness: SparseMatrix,
    pub damping: Damping,
    /// None where all entries are zero.
    pub gyroscopic: Option<SparseMatrix>,
    pub circulatory: Option<SparseMatrix>,
    /// F, with the first values of the loads that are switched.
    pub force: Vec<f64>,
    pub contacts: Vec<ContactInput>,
    pub impact_friction: bool,
    pub loads: Loads,
    /// The dofs of the states of contacts, and the constant forces that bristles bring along.
    pub hidden: Vec<HiddenDof>,
    pub hidden_force: Vec<f64>,
}

/// The dof p of the state z of a contact, and its mass.
pub(crate) struct HiddenDof {
    pub contact: usize,
    pub dof: usize,
    pub mass: f64,
}

impl Validated {
    pub fn new(input: SceneInput) -> Result<Self, Error> {
        let size = match &input.mass {
            Mass::Lumped(mass) => mass.len(),
            Mass::Full(mass) => mass.nrows(),
            Mass::Sparse(mass) => mass.size(),
        };
        if size == 0 {
            return Err(Error::shape("mass", "at least one dof", "none".into()));
        }
        let mass = validated_mass(input.mass)?;
        let stiffness =
            of_size(size, "stiffness", input.stiffness)?.validated_symmetric("stiffness")?;
        // A matrix of zeros is none.
        let present = |matrix: &SparseMatrix| matrix.entries() > 0;
        let gyroscopic = match input.gyroscopic.filter(present) {
            Some(matrix) => {
                Some(of_size(size, "gyroscopic", matrix)?.validated_skew("gyroscopic")?)
            }
            None => None,
        };
        let circulatory = input.circulatory.filter(present);
        let circulatory =
            circulatory.map(|matrix| of_size(size, "circulatory", matrix)).transpose()?;
        circulatory.iter().try_for_each(|matrix| matrix.check_finite("circulatory"))?;
        let damping = validated_damping(size, input.damping)?;
        if input.force.len() != size {
            let expected = format!("shape ({size},)");
            return Err(Error::shape("force", &expected, format!("({},)", input.force.len())));
        }
        check_finite("force", &input.force)?;
        for (contact, law) in input.contacts.iter().enumerate() {
            law.validate(contact, size)?;
        }
        check_planes(&input.contacts)?;
        let contacts = with_loops(input.contacts)?;
        input.loads.validate(size, contacts.len())?;
        let mut force = input.force;
        for load in &input.loads.steps {
            load.direction.iter().for_each(|&(dof, entry)| force[dof] += load.values[0] * entry);
        }
        let SceneInput { impact_friction, loads, .. } = input;
        Ok(Self {
            mass,
            stiffness,
            damping,
            gyroscopic,
            circulatory,
            force,
            contacts,
            impact_friction,
            loads,
            hidden: Vec::new(),
            hidden_force: Vec::new(),
        })
    }

    pub fn lacks_mass(&self, dof: usize) -> bool {
        self.mass.get(dof, dof) == 0.0
    }
}

fn of_size(size: usize, argument: &str, matrix: SparseMatrix) -> Result<SparseMatrix, Error> {
    if matrix.size() == size {
        return Ok(matrix);
    }
    let expected = format!("shape ({size}, {size})");
    Err(Error::shape(argument, &expected, format!("({0}, {0})", matrix.size())))
}

fn validated_damping(size: usize, damping: Damping) -> Result<Damping, Error> {
    match damping {
        Damping::Proportional { mass, stiffness } => {
            for (field, value) in [("damping.mass", mass), ("damping.stiffness", stiffness)] {
                let requirement = if value.is_finite() { ">= 0" } else { "finite" };
                if !(value.is_finite() && value >= 0.0) {
                    return Err(Error::Range { argument: field.into(), requirement, value });
                }
            }
            Ok(damping)
        }
        Damping::General(matrix) => {
            of_size(size, "damping", matrix)?.validated_symmetric("damping").map(Damping::General)
        }
    }
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
                return Err(Error::shape(
                    "mass",
                    "shape (n,) or (n, n)",
                    format!("({rows}, {columns})"),
                ));
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
