//! Branches of eigenvalues at given values of a parameter.

use num_complex::Complex64;

use crate::branches::{Member, Mesh, Node};
use crate::error::Error;
use crate::path::Path;

/// All 2m branches at every value. Arrays are row-major over (value, branch), vectors over (value, coordinate, branch);
/// the branches are sorted at the first value: by modulus, conjugates adjacent, positive imaginary part first.
#[derive(Debug, Clone)]
pub struct Sweep {
    pub values: Vec<f64>,
    pub branches: usize,
    pub eigenvalues: Vec<Complex64>,
    /// `d lambda / d p`
    pub slopes: Vec<Complex64>,
    pub condition: Vec<f64>,
    pub a: Vec<Complex64>,
    /// Displacement parts xi and v of the right and left state vectors (xi, lambda xi), (v, lambda v).
    pub right: Vec<Complex64>,
    pub left: Vec<Complex64>,
    /// Parameter values at which branches meet, so that their continuation is a convention.
    pub meetings: Vec<f64>,
}

impl Sweep {
    /// At `values`, ascending and at least one; `vectors` asks for right and left ones.
    pub fn new(path: &Path, values: &[f64], vectors: bool) -> Result<Self, Error> {
        let mesh = Mesh::new(path, values, &|_, _, _| true)?;
        let branches = mesh.nodes.first().map_or(0, |node| node.members().len());
        let count = values.len() * branches;
        let mut sweep = Self {
            values: values.to_vec(),
            branches,
            eigenvalues: Vec::with_capacity(count),
            slopes: Vec::with_capacity(count),
            condition: Vec::with_capacity(count),
            a: Vec::with_capacity(count),
            right: Vec::new(),
            left: Vec::new(),
            meetings: mesh
                .links
                .iter()
                .zip(mesh.nodes.windows(2))
                .filter(|(link, _)| link.meeting)
                .map(|(_, pair)| 0.5 * (pair[0].value + pair[1].value))
                .collect(),
        };
        let mut carriers: Vec<usize> = (0..branches).collect();
        let mut wanted = values.iter().peekable();
        let mut crossings = mesh.crossings.iter().peekable();
        for (k, node) in mesh.nodes.iter().enumerate() {
            if k > 0 {
                let previous = &mesh.nodes[k - 1];
                while let Some(crossing) = crossings.next_if(|crossing| crossing.value < node.value)
                {
                    // The eigenvalues that cross here are equal, so the nearest ones are right.
                    let next = previous.nearest(crossing);
                    let there: Vec<usize> = carriers.iter().map(|&carrier| next[carrier]).collect();
                    wanted.next();
                    sweep.push(crossing, &there, vectors);
                }
                carriers.iter_mut().for_each(|branch| *branch = mesh.links[k - 1].next[*branch]);
            }
            if wanted.next_if(|&&value| value == node.value).is_some() {
                sweep.push(node, &carriers, vectors);
            }
        }
        Ok(sweep)
    }

    fn push(&mut self, node: &Node, carriers: &[usize], vectors: bool) {
        let all = node.members();
        let members: Vec<Member> = carriers.iter().map(|&carrier| all[carrier]).collect();
        let oriented = |z: Complex64, member: &Member| if member.conjugate { z.conj() } else { z };
        for member in &members {
            let mode = &node.modes[member.mode];
            self.eigenvalues.push(node.eigenvalue(*member));
            self.slopes.push(oriented(node.slopes[member.mode], member));
            self.a.push(oriented(mode.a, member));
            self.condition.push(mode.condition);
        }
        let coordinates =
            if vectors { node.modes.first().map_or(0, |mode| mode.right.len()) } else { 0 };
        for i in 0..coordinates {
            for member in &members {
                let mode = &node.modes[member.mode];
                self.right.push(oriented(mode.right[i], member));
                self.left.push(oriented(mode.left[i], member));
            }
        }
    }
}
