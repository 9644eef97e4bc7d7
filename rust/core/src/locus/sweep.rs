//! Branches of eigenvalues at given values of a parameter.

use std::borrow::Cow;

use num_complex::Complex64;
use rayon::prelude::*;

use crate::error::input::Error;
use crate::linalg::eigenpair::turned;
use crate::linalg::parallel::in_parallel;
use crate::locus::branches::Mesh;
use crate::locus::critical::point::UNDEFINED;
use crate::locus::leading::leading;
use crate::locus::node::{Member, Node};
use crate::locus::parameter_path::{Path, PathDamping, Piece};
use crate::locus::watched_path::WatchedPath;
use crate::modes::growth::{Verdict, pencil_growth, proportional_growth};
use crate::modes::mass_factor::MassFactor;

/// All branches at every value, or those of some modes. Arrays are row-major over (value, branch), vectors over (value,
/// coordinate, branch); the branches are sorted at the first value: by modulus, conjugates adjacent, positive imaginary part
/// first.
#[derive(Debug, Clone)]
pub struct Sweep {
    /// Parameter values, ascending.
    pub values: Vec<f64>,
    /// Number of branches followed.
    pub branches: usize,
    /// lambda, 1/s; a positive real part grows.
    pub eigenvalues: Vec<Complex64>,
    /// Whether a mode grows by more than rounding.
    pub unstable: Vec<bool>,
    /// Whether no mode at a value does, followed or not.
    pub stable: Vec<bool>,
    /// `d lambda / d p`
    pub slopes: Vec<Complex64>,
    /// Condition number of each eigenvalue, -.
    pub condition: Vec<f64>,
    /// Whether the condition number is so large that the mode has no left vector.
    pub defective: Vec<bool>,
    /// NaN, as the left vectors, where a mode is defective.
    pub a: Vec<Complex64>,
    /// Displacement parts xi and v of the right and left state vectors (xi, lambda xi), (v, lambda v).
    pub right: Vec<Complex64>,
    /// Displacement parts v of the left vectors; empty, as `right`, where vectors were not asked for.
    pub left: Vec<Complex64>,
    /// Parameter values at which branches meet, so that their continuation is a convention.
    pub meetings: Vec<f64>,
}

impl Sweep {
    /// The sweep at `values`, ascending and at least one. `vectors` asks for right and left vectors; `modes` limits the sweep
    /// to that many modes of the first value, those that have the largest real parts at any of the values.
    pub fn new(
        path: WatchedPath<'_>,
        values: &[f64],
        vectors: bool,
        modes: Option<usize>,
    ) -> Result<Self, Error> {
        let (mesh, branches) = match modes {
            Some(modes) => leading(path, values, modes)?,
            None => {
                let mesh = Mesh::new(path, values, &|_, _, _| true)?;
                let count = mesh.nodes.first().map_or(0, |node| node.members().len());
                (mesh, (0..count).collect())
            }
        };
        let mut rows = rows(&mesh, values, branches);
        if let Some(modes) = modes {
            keep_largest(&mut rows, modes);
        }
        let branches = rows.first().map_or(0, |row| row.carriers.len());
        let length = if vectors { branches * path.size } else { 0 };
        let zeros = || vec![Complex64::default(); values.len() * length];
        let (mut right, mut left) = (zeros(), zeros());
        // Chunks of length zero are not allowed, and there is nothing in them.
        let both = right.par_chunks_mut(length.max(1)).zip(left.par_chunks_mut(length.max(1)));
        in_parallel(|| rows.par_iter().zip(both).for_each(|(row, both)| row.fill(both)));
        let count = values.len() * branches;
        let mut sweep = Self {
            values: values.to_vec(),
            branches,
            eigenvalues: Vec::with_capacity(count),
            unstable: Vec::with_capacity(count),
            stable: Vec::with_capacity(values.len()),
            slopes: Vec::with_capacity(count),
            condition: Vec::with_capacity(count),
            defective: Vec::with_capacity(count),
            a: Vec::with_capacity(count),
            right,
            left,
            meetings: mesh
                .links
                .iter()
                .zip(mesh.nodes.windows(2))
                .filter(|(link, _)| link.meeting)
                .map(|(_, pair)| 0.5 * (pair[0].value + pair[1].value))
                .collect(),
        };
        for Row { node, carriers } in &rows {
            sweep.stable.push(!node.unstable.contains(&true));
            let members = node.members();
            for &carrier in carriers {
                let Member { mode: index, conjugate } = members[carrier];
                let mode = &node.modes[index];
                let defective = mode.is_defective();
                sweep.eigenvalues.push(turned(mode.eigenvalue, conjugate));
                sweep.unstable.push(node.unstable[index]);
                sweep.slopes.push(turned(node.slopes[index], conjugate));
                sweep.condition.push(mode.condition);
                sweep.defective.push(defective);
                sweep.a.push(if defective { UNDEFINED } else { turned(mode.a, conjugate) });
            }
        }
        // A mesh of many nodes takes its time to drop as well.
        in_parallel(|| mesh.nodes.into_par_iter().for_each(drop));
        Ok(sweep)
    }
}

/// A node at a wanted value, with the member that carries each branch.
struct Row<'a> {
    node: &'a Node,
    carriers: Vec<usize>,
}

impl Row<'_> {
    /// Writes right and left vectors, over (coordinate, branch).
    fn fill(&self, (right, left): (&mut [Complex64], &mut [Complex64])) {
        let members = self.node.members();
        for (branch, &carrier) in self.carriers.iter().enumerate() {
            let Member { mode, conjugate } = members[carrier];
            let mode = &self.node.modes[mode];
            let into = |target: &mut [Complex64], vector: &[Complex64], defined: bool| {
                let column = target.iter_mut().skip(branch).step_by(self.carriers.len());
                let entry = |&z| if defined { turned(z, conjugate) } else { UNDEFINED };
                column.zip(vector.iter().map(entry)).for_each(|(place, z)| *place = z);
            };
            into(right, &mode.right, true);
            into(left, &mode.left, !mode.is_defective());
        }
    }
}

/// Keeps the branches of so many modes of the first row, those of the largest real part at any value.
fn keep_largest(rows: &mut [Row<'_>], modes: usize) {
    let Some(first) = rows.first() else { return };
    let members = first.node.members();
    let own: Vec<usize> = first.carriers.iter().map(|&carrier| members[carrier].mode).collect();
    let mut largest = vec![f64::NEG_INFINITY; first.node.modes.len()];
    for row in &*rows {
        let members = row.node.members();
        for (&mode, &carrier) in own.iter().zip(&row.carriers) {
            largest[mode] = largest[mode].max(row.node.eigenvalue(members[carrier]).re);
        }
    }
    let mut order: Vec<usize> = (0..largest.len()).collect();
    order.sort_by(|&r, &s| largest[s].total_cmp(&largest[r]));
    order.truncate(modes);
    for row in rows {
        let mut own = own.iter();
        row.carriers.retain(|_| own.next().is_some_and(|mode| order.contains(mode)));
    }
}

/// The node of every value, with the members that carry `branches`, members of the first node.
fn rows<'a>(mesh: &'a Mesh, values: &[f64], branches: Vec<usize>) -> Vec<Row<'a>> {
    let mut carriers = branches;
    let mut rows = Vec::with_capacity(values.len());
    let mut values = values.iter().peekable();
    let mut crossings = mesh.crossings.iter().peekable();
    for (k, node) in mesh.nodes.iter().enumerate() {
        if k > 0 {
            let previous = &mesh.nodes[k - 1];
            while let Some(crossing) = crossings.next_if(|crossing| crossing.value < node.value) {
                // The eigenvalues that cross here are equal, so the nearest ones are right.
                let wanted = |carrier: usize, _| carriers.contains(&carrier);
                let next = previous.nearest(crossing, previous.apart(), wanted);
                values.next();
                let carriers = carriers.iter().map(|&carrier| next[carrier]).collect();
                rows.push(Row { node: crossing, carriers });
            }
            carriers.iter_mut().for_each(|branch| *branch = mesh.links[k - 1].next[*branch]);
        }
        if values.next_if(|&&value| value == node.value).is_some() {
            rows.push(Row { node, carriers: carriers.clone() });
        }
    }
    rows
}

/// Most coordinates of a reduced problem with which a verdict takes microseconds.
const SMALL: usize = 16;

/// At parameter values of a path.
pub fn verdicts_along(path: &Path, values: &[f64]) -> Result<Vec<Verdict>, Error> {
    let factor =
        |piece: &Piece, t| MassFactor::new(piece.mass.rows(t).rounded(), &path.combination);
    let proportional = |piece: &&Piece| matches!(piece.damping, PathDamping::Proportional { .. });
    let piece = path.piece_of_constant_mass().filter(proportional);
    let shared =
        piece.filter(|_| !values.is_empty()).map(|piece| factor(piece, 0.0)).transpose()?;
    let verdict = |&value: &f64| {
        let (piece, t) = path.place(value);
        let stiffness = piece.stiffness.at(t);
        let growth = match &piece.damping {
            PathDamping::Proportional { alpha, beta } => {
                let own;
                let factor = match &shared {
                    Some(shared) => shared,
                    None => {
                        own = factor(piece, t)?;
                        &own
                    }
                };
                let law = [alpha.value(t), beta.value(t)];
                proportional_growth(factor, &stiffness, law, || Cow::Owned(path.pencil(value)))?
            }
            PathDamping::General(_) => pencil_growth(&path.pencil(value))?,
        };
        Ok(Verdict { growth, steady: piece.statics.at(t).steady(&path.combination, &stiffness) })
    };
    // Verdicts on few coordinates are too short to be handed out one by one.
    let together = if path.size <= SMALL { 64 } else { 1 };
    in_parallel(|| values.par_iter().with_min_len(together).map(verdict).collect())
}
