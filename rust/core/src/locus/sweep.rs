//! Branches of eigenvalues at given values of a parameter.

use std::borrow::Cow;

use num_complex::Complex64;
use rayon::prelude::*;

use crate::error::input::Error;
use crate::linalg::eigenpair::turned;
use crate::linalg::parallel::in_parallel;
use crate::locus::branches::Mesh;
use crate::locus::leading::leading;
use crate::locus::node::Node;
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
        let entries = if vectors { branches * path.size } else { 0 };
        let zero = Complex64::default();
        let table = || vec![zero; values.len() * branches];
        let mut sweep = Self {
            values: values.to_vec(),
            branches,
            eigenvalues: table(),
            unstable: vec![false; values.len() * branches],
            stable: rows.iter().map(Row::is_stable).collect(),
            slopes: table(),
            condition: vec![0.0; values.len() * branches],
            defective: vec![false; values.len() * branches],
            a: table(),
            right: vec![zero; values.len() * entries],
            left: vec![zero; values.len() * entries],
            meetings: mesh
                .links
                .iter()
                .zip(mesh.nodes.windows(2))
                .filter(|(link, _)| link.meeting)
                .map(|(_, pair)| 0.5 * (pair[0].value + pair[1].value))
                .collect(),
        };
        // Chunks of length zero are not allowed, and there is nothing in them.
        let (branches, entries) = (branches.max(1), entries.max(1));
        let mut chunks: Vec<Chunk<'_>> = rows
            .into_iter()
            .zip(sweep.eigenvalues.chunks_mut(branches))
            .zip(sweep.unstable.chunks_mut(branches))
            .zip(sweep.slopes.chunks_mut(branches))
            .zip(sweep.condition.chunks_mut(branches))
            .zip(sweep.defective.chunks_mut(branches))
            .zip(sweep.a.chunks_mut(branches))
            .map(|((((((row, eigenvalues), unstable), slopes), condition), defective), a)| Chunk {
                row,
                eigenvalues,
                unstable,
                slopes,
                condition,
                defective,
                a,
                vectors: None,
            })
            .collect();
        if vectors {
            let both = sweep.right.chunks_mut(entries).zip(sweep.left.chunks_mut(entries));
            chunks.iter_mut().zip(both).for_each(|(chunk, both)| chunk.vectors = Some(both));
        }
        in_parallel(|| chunks.into_par_iter().for_each(Chunk::fill));
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
    fn is_stable(&self) -> bool {
        !self.node.unstable.contains(&true)
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

/// The part of a sweep's arrays that belongs to one value.
struct Chunk<'a> {
    row: Row<'a>,
    eigenvalues: &'a mut [Complex64],
    unstable: &'a mut [bool],
    slopes: &'a mut [Complex64],
    condition: &'a mut [f64],
    defective: &'a mut [bool],
    a: &'a mut [Complex64],
    /// Right and left, over (coordinate, branch).
    vectors: Option<(&'a mut [Complex64], &'a mut [Complex64])>,
}

impl Chunk<'_> {
    fn fill(self) {
        let Row { node, carriers } = self.row;
        let members = node.members();
        let branches = carriers.len();
        let mut vectors = self.vectors;
        for (branch, &carrier) in carriers.iter().enumerate() {
            let member = members[carrier];
            let mode = &node.modes[member.mode];
            let oriented = |z| turned(z, member.conjugate);
            self.eigenvalues[branch] = node.eigenvalue(member);
            self.unstable[branch] = node.unstable[member.mode];
            self.slopes[branch] = oriented(node.slopes[member.mode]);
            let defective = mode.is_defective();
            let undefined = Complex64::new(f64::NAN, f64::NAN);
            self.a[branch] = if defective { undefined } else { oriented(mode.a) };
            self.condition[branch] = mode.condition;
            self.defective[branch] = defective;
            if let Some((right, left)) = &mut vectors {
                let into = |target: &mut [Complex64], vector: &[Complex64]| {
                    let column = target[branch..].iter_mut().step_by(branches);
                    column.zip(vector).for_each(|(entry, &z)| *entry = oriented(z));
                };
                into(right, &mode.right);
                into(left, &mode.left);
                if defective {
                    left[branch..]
                        .iter_mut()
                        .step_by(branches)
                        .for_each(|entry| *entry = undefined);
                }
            }
        }
    }
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
