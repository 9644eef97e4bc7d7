//! Scenes.

use std::sync::{Arc, OnceLock};

use num_complex::Complex64;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use stickslip_core as core;

use crate::convert::{MatrixInput, SparseParts, entries, from_rows, matrix, sparse_parts, vector};
use crate::errors::raise;
use crate::interrupt::{computed, detached};
use crate::modes::{self, Reduced};
use crate::scene::input::{
    ContactData, DampingInput, ElementData, LoadData, MassInput, contact_inputs, elements,
    friction_laws, loads,
};

/// The combination of a state, with the friction forces that its compliant contacts hold and the states of contacts.
#[derive(FromPyObject)]
pub enum StatusInput {
    Plain(String),
    Holding(String, Vec<f64>, Vec<f64>),
}

/// Position, combination and normal forces.
type EquilibriumData<'py> = (Bound<'py, PyArray1<f64>>, String, Bound<'py, PyArray1<f64>>);

/// What makes a scene nonlinear within a phase.
struct Nonlinear {
    laws: Vec<Option<core::scene::FrictionLaw>>,
    elements: Vec<core::scene::ElementInput>,
}

impl Nonlinear {
    fn new(contacts: &[ContactData<'_>], elements: &[ElementData]) -> Result<Self, core::Error> {
        Ok(Self { laws: friction_laws(contacts)?, elements: self::elements(elements, contacts)? })
    }

    fn beside(&self, scene: core::Scene) -> Result<core::Scene, core::Error> {
        scene.with_friction_laws(self.laws.clone())?.with_elements(&self.elements)
    }
}

#[pyclass(frozen, module = "stickslip._core")]
pub struct Scene {
    /// In coordinates for rest and modes alone, where a scene has them.
    sparse: Option<Arc<core::Scene>>,
    propagators: OnceLock<Arc<core::Propagators>>,
    pub input: core::SceneInput,
    nonlinear: Nonlinear,
}

impl Scene {
    fn build(
        py: Python<'_>,
        input: core::SceneInput,
        nonlinear: Result<Nonlinear, core::Error>,
    ) -> PyResult<Self> {
        let nonlinear = nonlinear.map_err(|error| raise(py, &error))?;
        let sparse = computed(py, || match core::Scene::in_sparse_coordinates(&input)? {
            Some(scene) => nonlinear.beside(scene).map(Arc::new).map(Some),
            None => Ok(None),
        })?;
        let scene = Self { sparse, propagators: OnceLock::new(), input, nonlinear };
        if scene.sparse.is_none() {
            scene.propagators(py)?;
        }
        Ok(scene)
    }

    /// The scene in the coordinates of motions with its propagators, made when they are first asked for.
    pub fn propagators(&self, py: Python<'_>) -> PyResult<&Arc<core::Propagators>> {
        if let Some(known) = self.propagators.get() {
            return Ok(known);
        }
        let scene = computed(py, || self.nonlinear.beside(core::Scene::new(self.input.clone())?))?;
        Ok(self.propagators.get_or_init(|| Arc::new(core::Propagators::new(Arc::new(scene)))))
    }

    pub fn core(&self, py: Python<'_>) -> PyResult<&Arc<core::Scene>> {
        Ok(self.propagators(py)?.bare())
    }

    /// The scene in the coordinates for rest and modes.
    fn resting(&self, py: Python<'_>) -> PyResult<&Arc<core::Scene>> {
        self.sparse.as_ref().map_or_else(|| self.core(py), Ok)
    }

    fn dofs(&self) -> usize {
        self.input.force.len()
    }

    pub fn combination(&self, py: Python<'_>, text: &str) -> PyResult<core::Combination> {
        core::Combination::parse(text, self.input.contacts.len())
            .map(|combination| combination.among(&self.input.contacts))
            .map_err(|error| raise(py, &error))
    }

    pub fn start(
        &self,
        py: Python<'_>,
        position: &PyReadonlyArray1<'_, f64>,
        velocity: &PyReadonlyArray1<'_, f64>,
        combination: &StatusInput,
    ) -> PyResult<core::State> {
        let (combination, friction_force, internal) = match combination {
            StatusInput::Plain(combination) => (combination, Vec::new(), Vec::new()),
            StatusInput::Holding(combination, forces, states) => {
                (combination, forces.clone(), states.clone())
            }
        };
        Ok(core::State {
            position: vector(position),
            velocity: vector(velocity),
            combination: self.combination(py, combination)?,
            friction_force,
            internal,
        })
    }
}

#[pymethods]
impl Scene {
    #[new]
    fn new(
        py: Python<'_>,
        mass: MassInput<'_>,
        stiffness: (MatrixInput<'_>, Option<MatrixInput<'_>>),
        damping: (DampingInput<'_>, Option<MatrixInput<'_>>),
        force: (PyReadonlyArray1<'_, f64>, LoadData),
        contacts: (Vec<ContactData<'_>>, Vec<ElementData>),
        impact_friction: bool,
    ) -> PyResult<Self> {
        let (contacts, elements) = contacts;
        let ((stiffness, circulatory), (damping, gyroscopic)) = (stiffness, damping);
        let (force, loads) = force;
        let mass = match mass {
            MassInput::Lumped(mass) => core::scene::Mass::Lumped(vector(&mass)),
            MassInput::Full(MatrixInput::Dense(mass)) => {
                let mass = mass.as_array();
                let (rows, columns) = mass.dim();
                core::scene::Mass::Full(from_rows(rows, columns, entries(mass)))
            }
            MassInput::Full(mass) => core::scene::Mass::Sparse(mass.to_matrix(py, "mass")?),
        };
        let damping = match damping {
            DampingInput::Proportional(mass, stiffness) => {
                core::scene::Damping::Proportional { mass, stiffness }
            }
            DampingInput::General(matrix) => {
                core::scene::Damping::General(matrix.to_matrix(py, "damping")?)
            }
        };
        let optional = |given: Option<MatrixInput<'_>>, argument: &str| {
            given.map(|matrix| matrix.to_matrix(py, argument)).transpose()
        };
        let input = core::SceneInput {
            mass,
            stiffness: stiffness.to_matrix(py, "stiffness")?,
            damping,
            gyroscopic: optional(gyroscopic, "gyroscopic")?,
            circulatory: optional(circulatory, "circulatory")?,
            force: vector(&force),
            contacts: contact_inputs(&contacts).map_err(|error| raise(py, &error))?,
            impact_friction,
            loads: self::loads(loads),
        };
        Self::build(py, input, Nonlinear::new(&contacts, &elements))
    }

    /// The same system with other contacts, elements and loads in time.
    fn with_contacts(
        &self,
        py: Python<'_>,
        contacts: (Vec<ContactData<'_>>, Vec<ElementData>),
        loads: LoadData,
    ) -> PyResult<Self> {
        let (contacts, elements) = contacts;
        let input = core::SceneInput {
            contacts: contact_inputs(&contacts).map_err(|error| raise(py, &error))?,
            loads: self::loads(loads),
            ..self.input.clone()
        };
        Self::build(py, input, Nonlinear::new(&contacts, &elements))
    }

    #[getter]
    fn size(&self) -> usize {
        self.dofs()
    }

    /// Whether friction of some contact depends on slip speed.
    #[getter]
    fn has_friction_laws(&self, py: Python<'_>) -> PyResult<bool> {
        Ok(self.resting(py)?.has_friction_laws())
    }

    /// Whether friction acts in a plane.
    #[getter]
    fn has_planes(&self, py: Python<'_>) -> PyResult<bool> {
        let scene = self.resting(py)?;
        Ok(scene.has_planes() || scene.has_elastic_planes())
    }

    /// Whether the scene has springs or dampers that are no entries of its matrices.
    #[getter]
    fn has_elements(&self, py: Python<'_>) -> PyResult<bool> {
        Ok(self.resting(py)?.has_elements())
    }

    /// By element, at rest in a combination: its stretch or rate, its force there and the first three derivatives of the force.
    fn elements_at_rest(&self, py: Python<'_>, combination: &str) -> PyResult<Vec<[f64; 5]>> {
        let combination = self.combination(py, combination)?;
        let scene = self.resting(py)?;
        computed(py, || core::motion::elements_at_rest(scene, &combination))
    }

    /// Whether some dofs or compliant contacts have no mass.
    #[getter]
    fn has_massless(&self, py: Python<'_>) -> PyResult<bool> {
        Ok(self.resting(py)?.has_massless())
    }

    fn reduced(&self, py: Python<'_>, combination: &str) -> PyResult<Reduced> {
        let combination = self.combination(py, combination)?;
        let scene = self.core(py)?;
        let reduced = detached(py, || {
            core::Reduced::new(scene, &combination).and_then(|reduced| Reduced::new(scene, reduced))
        })?;
        reduced.map_err(|error| raise(py, &error))
    }

    fn modes<'py>(&self, py: Python<'py>, combination: &str) -> PyResult<Bound<'py, PyDict>> {
        let combination = self.combination(py, combination)?;
        let scene = self.core(py)?;
        let found = computed(py, || core::Modes::new(scene, &combination))?;
        modes::modes(py, self.dofs(), found)
    }

    /// `L' M R`, `L' C R` and `L' K R` of a combination as compressed rows.
    fn sparse_pencil<'py>(
        &self,
        py: Python<'py>,
        combination: &str,
    ) -> PyResult<[SparseParts<'py>; 3]> {
        let combination = self.combination(py, combination)?;
        let scene = self.resting(py)?;
        let matrices = computed(py, || core::modes::sparse_pencil(scene, &combination))?;
        Ok(matrices.map(|matrix| sparse_parts(py, &matrix)))
    }

    /// What `Reduced.statics` holds, without dense matrices.
    fn statics<'py>(
        &self,
        py: Python<'py>,
        combination: &str,
    ) -> PyResult<[Bound<'py, PyArray2<f64>>; 4]> {
        let combination = self.combination(py, combination)?;
        let statics = core::scene::Statics::of(self.resting(py)?, &combination)
            .map_err(|error| raise(py, &error))?;
        modes::statics(py, statics)
    }

    /// Pairs found elsewhere, by rows of (k, m), corrected and judged on the stated matrices.
    fn judged_pairs<'py>(
        &self,
        py: Python<'py>,
        combination: &str,
        eigenvalues: PyReadonlyArray1<'py, Complex64>,
        right: PyReadonlyArray2<'py, Complex64>,
        left: PyReadonlyArray2<'py, Complex64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let combination = self.combination(py, combination)?;
        let rows = |array: &PyReadonlyArray2<'_, Complex64>| -> Vec<Vec<Complex64>> {
            array.as_array().rows().into_iter().map(|row| row.to_vec()).collect()
        };
        let values = eigenvalues.as_array().to_vec();
        let vectors = rows(&right).into_iter().zip(rows(&left));
        let pairs =
            values.into_iter().zip(vectors).map(|(value, (right, left))| (value, right, left));
        let pairs = pairs.collect();
        let scene = self.resting(py)?;
        let judged = computed(py, || core::modes::judged_pairs(scene, &combination, pairs))?;
        modes::pairs(py, self.dofs(), &judged)
    }

    /// The combination of sliding as the sliders drive.
    fn sliding_combination(&self, py: Python<'_>) -> PyResult<String> {
        let combination =
            self.resting(py)?.sliding_combination().map_err(|error| raise(py, &error))?;
        Ok(combination.to_string())
    }

    /// The same, refused where a contact would pull.
    fn steady_sliding(&self, py: Python<'_>) -> PyResult<String> {
        let scene = self.resting(py)?;
        let combination = computed(py, || scene.steady_sliding())?;
        Ok(combination.to_string())
    }

    fn sliding_equilibrium<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(EquilibriumData<'py>, Option<bool>, Option<EquilibriumData<'py>>)> {
        let scene = self.resting(py)?;
        let (found, uniqueness) = computed(py, || scene.steady_equilibrium())?;
        let data = |found: core::scene::Equilibrium| {
            (
                found.state.position.into_pyarray(py),
                found.state.combination.to_string(),
                found.normal_forces.into_pyarray(py),
            )
        };
        Ok(match uniqueness {
            core::scene::Uniqueness::Proved => (data(found), Some(true), None),
            core::scene::Uniqueness::Another(other) => {
                (data(found), Some(false), Some(data(*other)))
            }
            core::scene::Uniqueness::Unknown => (data(found), None, None),
        })
    }

    /// Refuses a state that penetrates or violates its combination.
    fn check_state(
        &self,
        py: Python<'_>,
        position: PyReadonlyArray1<'_, f64>,
        velocity: PyReadonlyArray1<'_, f64>,
        combination: StatusInput,
    ) -> PyResult<()> {
        let state = self.start(py, &position, &velocity, &combination)?;
        let scene = self.propagators(py)?.moving();
        computed(py, || core::contact::start_coordinates(scene, &state))?;
        Ok(())
    }

    /// Normal and friction forces of a state, N.
    fn contact_forces(
        &self,
        py: Python<'_>,
        position: PyReadonlyArray1<'_, f64>,
        velocity: PyReadonlyArray1<'_, f64>,
        combination: StatusInput,
    ) -> PyResult<(Vec<f64>, Vec<f64>)> {
        let state = self.start(py, &position, &velocity, &combination)?;
        let scene = self.propagators(py)?.moving();
        let forces = detached(py, || core::contact::forces_of_state(scene, &state))?;
        Ok(forces.map_err(|error| raise(py, &error))?.into_iter().unzip())
    }

    /// Contacts whose forces nothing determines in a combination.
    fn undetermined(&self, py: Python<'_>, combination: &str) -> PyResult<Vec<usize>> {
        let combination = self.combination(py, combination)?;
        Ok(core::contact::undetermined(self.resting(py)?, &combination))
    }

    /// Whether directions of contacts depend on each other.
    #[getter]
    fn dependent(&self, py: Python<'_>) -> PyResult<bool> {
        Ok(self.resting(py)?.has_dependent_directions())
    }

    /// M, C + G, K + H and the symmetric and skew part of the latter over the dofs, as compressed rows.
    fn matrices<'py>(&self, py: Python<'py>) -> PyResult<[SparseParts<'py>; 5]> {
        let matrices = detached(py, || self.input.matrices())?;
        Ok(matrices.map(|matrix| sparse_parts(py, &matrix)))
    }

    /// mu of a contact and its first three derivatives over the slip speed, in steady sliding.
    fn friction_derivatives(&self, py: Python<'_>, contact: usize) -> PyResult<[f64; 4]> {
        let scene = self.resting(py)?;
        let core::Contact { friction, slider_speed, plane, .. } = &scene.contacts()[contact];
        let law = scene.friction_law(contact);
        let speed = slider_speed.hypot(plane.map_or(0.0, |plane| plane.slider_speed));
        Ok(law.map_or([*friction, 0.0, 0.0, 0.0], |law| core::motion::law_derivatives(law, speed)))
    }

    /// Of a contact with a state: its friction per normal force and the rate of its state with their derivatives, in steady sliding.
    fn state_derivatives(
        &self,
        py: Python<'_>,
        contact: usize,
    ) -> PyResult<Option<[[f64; 10]; 2]>> {
        Ok(core::motion::state_derivatives(self.resting(py)?, contact))
    }

    /// By row: the tangential and the normal direction of every contact.
    fn contact_directions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows = self.input.directions();
        matrix(py, rows.len(), self.dofs(), rows.concat())
    }

    /// By row: how contact forces along each direction are told from a load on the dofs.
    fn contact_basis<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let scene = self.core(py)?;
        let columns = detached(py, || scene.contact_basis())?;
        matrix(py, columns.len(), self.dofs(), columns.concat())
    }
}
