//! Chains of subsystems.

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use stickslip_core as core;

use crate::convert::{SparseParts, sparse_parts, vector};
use crate::errors::named;

/// The subsystems and links of a chain as columns, one for each of their fields.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct ChainColumns<'py> {
    upper_mass: PyReadonlyArray1<'py, f64>,
    contact_mass: PyReadonlyArray1<'py, f64>,
    inclination: PyReadonlyArray1<'py, f64>,
    vertical_stiffness: PyReadonlyArray1<'py, f64>,
    horizontal_stiffness: PyReadonlyArray1<'py, f64>,
    ceiling_stiffness: PyReadonlyArray1<'py, f64>,
    preload_displacement: PyReadonlyArray1<'py, f64>,
    external_force: PyReadonlyArray1<'py, f64>,
    link_horizontal: PyReadonlyArray1<'py, f64>,
    link_vertical: PyReadonlyArray1<'py, f64>,
}

impl ChainColumns<'_> {
    pub fn parts(
        &self,
        py: Python<'_>,
    ) -> PyResult<(Vec<core::scene::Subsystem>, Vec<core::scene::Link>)> {
        let upper = vector(&self.upper_mass);
        let count = upper.len();
        let column = |name: &str, values: &PyReadonlyArray1<'_, f64>, length: usize| {
            let values = vector(values);
            if values.len() == length {
                return Ok(values);
            }
            let message = format!("{name}: expected shape ({length},), got ({},)", values.len());
            Err(named(py, "InputError", &message))
        };
        let contact = column("contact_mass", &self.contact_mass, count)?;
        let inclination = column("inclination", &self.inclination, count)?;
        let vertical = column("vertical_stiffness", &self.vertical_stiffness, count)?;
        let horizontal = column("horizontal_stiffness", &self.horizontal_stiffness, count)?;
        let ceiling = column("ceiling_stiffness", &self.ceiling_stiffness, count)?;
        let preload = column("preload_displacement", &self.preload_displacement, count)?;
        let external = column("external_force", &self.external_force, count)?;
        let between = count.saturating_sub(1);
        let link_horizontal = column("link_horizontal", &self.link_horizontal, between)?;
        let link_vertical = column("link_vertical", &self.link_vertical, between)?;
        let subsystems = (0..count).map(|i| core::scene::Subsystem {
            upper_mass: upper[i],
            contact_mass: contact[i],
            inclination: inclination[i],
            vertical_stiffness: vertical[i],
            horizontal_stiffness: horizontal[i],
            ceiling_stiffness: ceiling[i],
            preload_displacement: preload[i],
            external_force: external[i],
        });
        let links = (0..between).map(|i| core::scene::Link {
            horizontal_stiffness: link_horizontal[i],
            vertical_stiffness: link_vertical[i],
        });
        Ok((subsystems.collect(), links.collect()))
    }
}

type ChainParts<'py> = (Bound<'py, PyArray1<f64>>, SparseParts<'py>, Bound<'py, PyArray1<f64>>);

/// (mass, stiffness as compressed rows, force) of a chain of subsystems.
#[pyfunction]
pub fn chain<'py>(
    py: Python<'py>,
    columns: ChainColumns<'py>,
    wall_stiffness: f64,
) -> PyResult<ChainParts<'py>> {
    let (subsystems, links) = columns.parts(py)?;
    let (mass, stiffness, force) = core::scene::chain(&subsystems, &links, wall_stiffness);
    Ok((mass.into_pyarray(py), sparse_parts(py, &stiffness), force.into_pyarray(py)))
}
