//! The modes of one combination, laid out for propagation: everything that does not depend on the state.

use std::sync::OnceLock;

use nalgebra::DMatrix;
use num_complex::Complex64;

use crate::contact::event_function::EventFunction;
use crate::modes::mode::Mode;
use crate::modes::spectrum::REFINED_SIZE;
use crate::motion::modal::level::{LEVELS, Level};
use crate::motion::modal::reference::{At, Reference};
use crate::motion::panel::REACH;
use crate::numerics::first_root::polynomial::DEGREE;
use crate::numerics::simd::{ComplexGroup, ComplexVector, GROUP, Group, complex_groups, in_groups};
use crate::scene::model::Scene;
use crate::scene::reduction::reduced_system::Reduced;

/// Groups of coordinates whose sums over the modes run side by side, since one sum waits for each of its additions; what
/// is read of a mode serves them all.
pub(super) const SUPERPOSED: usize = 4;
/// Groups of modes whose sums over the coordinates run side by side.
pub(super) const PROJECTED: usize = 2;

/// Roundings of an amplitude beside those of the sum over the coordinates.
const IN_PROJECTION: usize = 8;

/// Operations on the amplitudes of a panel: dot products of this many complex terms, a table built by DEGREE multiplications,
/// and Horner's rule.
pub(super) fn operations(count: usize) -> usize {
    2 * count + 3 * DEGREE + 10
}

/// Modes ascending in modulus, one of each conjugate pair, in groups filled up with zeros.
#[derive(Debug)]
pub(crate) struct ModalBasis {
    pub(super) kept: Vec<usize>,
    /// Number of modes that belong to the structure; the others carry loads.
    pub(super) structure: usize,
    pub(super) count: usize,
    pub(super) groups: usize,
    /// Groups of kept coordinates, and groups of all parts of a reference.
    pub(super) positions: usize,
    pub(super) parts: usize,
    pub(super) lambda: ComplexVector,
    /// 1 / lambda, 0 where lambda is.
    pub(super) inverse: ComplexVector,
    /// Right vectors with the weight of the conjugate, `q_k = Re sum_r shape_r[k] z_r`: for every [`SUPERPOSED`] groups of
    /// kept coordinates, for each mode, of each of these groups.
    pub(super) shape: Vec<ComplexGroup>,
    /// For every [`PROJECTED`] groups of modes, for each kept coordinate, the factors of each of these groups.
    pub(super) projection: Vec<Projection>,
    /// (coordinate, speed) of the contacts that stick.
    pub(super) sticking: Vec<(usize, f64)>,
    /// Weights of the modes in each event function.
    pub(super) functions: Vec<Vec<Weight>>,
    /// The motions about which the modes may move: the origin, and the equilibrium where there is one.
    pub(super) references: Vec<Reference>,
    base_width: f64,
    levels: [OnceLock<Box<Level>>; LEVELS],
}

/// `z_r = sum_k position_rk q_k + velocity_rk q'_k`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Projection {
    pub position: ComplexGroup,
    pub velocity: ComplexGroup,
}

/// The weight of a group of modes in an event function.
#[derive(Debug, Clone, Copy)]
pub(super) struct Weight {
    pub of: ComplexGroup,
    /// |of|
    pub magnitude: Group,
    /// What rounding counts: |of|, and what the projection of the mode's motion on the other modes leaves in the function.
    pub rounded: Group,
}

impl ModalBasis {
    pub fn new(
        scene: &Scene,
        reduced: &Reduced,
        functions: &[EventFunction],
        mut modes: Vec<Mode>,
    ) -> Self {
        modes.sort_by(|p, q| p.eigenvalue.norm_sqr().total_cmp(&q.eigenvalue.norm_sqr()));
        let m = reduced.size();
        let count = modes.len();
        let groups = count.div_ceil(GROUP);
        let stride = groups * GROUP;
        let mut lambda = vec![Complex64::default(); stride];
        let mut shape = vec![Complex64::default(); m * stride];
        let mut from_position = shape.clone();
        let mut from_velocity = shape.clone();
        let part =
            |of: fn(Complex64) -> f64| DMatrix::from_fn(count, m, |r, k| of(modes[r].left[k]));
        let left = [part(|v| v.re), part(|v| v.im)];
        let [mass, damping] = [&reduced.mass, &reduced.damping]
            .map(|matrix| left.each_ref().map(|part| part * matrix));
        for (r, mode) in modes.iter().enumerate() {
            lambda[r] = mode.eigenvalue;
            let weight = if mode.is_real() { 1.0 } else { 2.0 };
            for k in 0..m {
                shape[k * stride + r] = weight * mode.right[k];
                // left' ((C + lambda M) q + M q') / a
                let [mass, damping] = [&mass, &damping]
                    .map(|[re, im]| Complex64::new(re[(r, k)], im[(r, k)]) / mode.a);
                from_velocity[k * stride + r] = mass;
                from_position[k * stride + r] = damping + mode.eigenvalue * mass;
            }
        }
        if m <= REFINED_SIZE {
            polish(&shape, &lambda, [&mut from_position, &mut from_velocity], (m, stride));
        }
        let references: Vec<Reference> = [Some(At::origin(reduced)), At::equilibrium(reduced)]
            .into_iter()
            .flatten()
            .map(|at| at.reference(scene, reduced, functions, &modes))
            .collect();
        let reduction = &reduced.reduction;
        let kept = |&(k, weight): &(usize, f64)| Some((reduction.place(k)?, weight));
        let part_of_projection = (m + IN_PROJECTION) as f64 / operations(count) as f64;
        let sizes_of = |all: &[Complex64]| all.iter().map(|one| one.norm()).collect::<Vec<f64>>();
        let [rates, shapes] = [&lambda, &shape].map(|all| sizes_of(all));
        let factors = [&from_position, &from_velocity].map(|all| sizes_of(all));
        let function_weights = functions
            .iter()
            .map(|function| {
                let functional = &function.functional;
                let mut weights = vec![Complex64::default(); stride];
                for (j, weight) in functional.position.iter().filter_map(kept) {
                    for r in 0..count {
                        weights[r] += weight * shape[j * stride + r];
                    }
                }
                for (j, weight) in functional.velocity.iter().filter_map(kept) {
                    for r in 0..count {
                        weights[r] += weight * lambda[r] * shape[j * stride + r];
                    }
                }
                let magnitudes: Vec<f64> = weights.iter().map(|weight| weight.norm()).collect();
                let mut rounded = magnitudes.clone();
                for k in 0..m {
                    let at = k * stride..k * stride + count;
                    let [of_position, of_velocity] = factors.each_ref().map(|from| -> f64 {
                        let factors = magnitudes.iter().zip(&from[at.clone()]);
                        factors.map(|(magnitude, factor)| magnitude * factor).sum()
                    });
                    for (r, shape) in shapes[at].iter().enumerate() {
                        let size = of_position + of_velocity * rates[r];
                        rounded[r] += part_of_projection * size * shape;
                    }
                }
                let sizes = in_groups(&magnitudes).into_iter().zip(in_groups(&rounded));
                let weights = complex_groups(&weights).zip(sizes);
                weights
                    .map(|(of, (magnitude, rounded))| Weight { of, magnitude, rounded })
                    .collect()
            })
            .collect();
        let fastest = modes.last().map_or(0.0, |mode| mode.eigenvalue.norm());
        let inverse: Vec<Complex64> = lambda
            .iter()
            .map(|lambda| if lambda.norm_sqr() > 0.0 { lambda.inv() } else { Complex64::default() })
            .collect();
        let positions = m.div_ceil(GROUP);
        let of_group = |group: usize, r: usize| {
            ComplexGroup::of(std::array::from_fn(|lane| {
                shape.get((group * GROUP + lane) * stride + r).copied().unwrap_or_default()
            }))
        };
        let shapes = in_blocks(positions, SUPERPOSED, count, of_group);
        let [from_position, from_velocity] =
            [from_position, from_velocity].map(|of| complex_groups(&of).collect::<Vec<_>>());
        let of_modes = |group: usize, k: usize| {
            let index = k * groups + group;
            Projection { position: from_position[index], velocity: from_velocity[index] }
        };
        let projection = in_blocks(groups, PROJECTED, m, of_modes);
        let lambda = ComplexVector::of(&lambda);
        let function_groups = functions.len().div_ceil(GROUP);
        Self {
            positions,
            parts: positions + 2 * groups + function_groups,
            structure: reduction.kept.partition_point(|&k| k < scene.structure()),
            kept: reduction.kept.clone(),
            count,
            groups,
            shape: shapes,
            projection,
            sticking: reduction.sticking.clone(),
            functions: function_weights,
            references,
            // Without modes every motion is prescribed and linear: the width grows to that of the phase.
            base_width: if fastest > 0.0 { REACH / fastest } else { 1e-12 },
            levels: [const { OnceLock::new() }; LEVELS],
            lambda,
            inverse: ComplexVector::of(&inverse),
        }
    }

    /// About how many numbers it holds: shapes and projections of every mode over every coordinate.
    pub fn numbers(&self) -> usize {
        6 * self.groups * GROUP * self.kept.len()
    }

    /// The shape of a mode at a kept coordinate.
    pub(super) fn shape(&self, k: usize, r: usize) -> Complex64 {
        let (group, lane) = (k / GROUP, k % GROUP);
        let first = group - group % SUPERPOSED;
        let side_by_side = SUPERPOSED.min(self.positions - first);
        self.shape[first * self.count + r * side_by_side + group - first].get(lane)
    }

    pub(super) fn level(&self, level: usize) -> &Level {
        self.levels[level].get_or_init(|| {
            Box::new(Level::new(&self.lambda, self.count, self.base_width * (level as f64).exp2()))
        })
    }
}

/// Makes the projection P of states `y = (q, q')` on modes the inverse of their superposition S to its own rounding:
/// `P (I + E)` with `E = I - S P`, a step of Newton's method. What P lacks would change every phase of a motion alike, and its
/// energy in proportion to the number of phases.
fn polish(
    shape: &[Complex64],
    lambda: &[Complex64],
    [from_position, from_velocity]: [&mut [Complex64]; 2],
    (m, stride): (usize, usize),
) {
    let superposed = |row: usize, r: usize| match row < m {
        true => shape[row * stride + r],
        false => shape[(row - m) * stride + r] * lambda[r],
    };
    let projected = |r: usize, column: usize| match column < m {
        true => from_position[column * stride + r],
        false => from_velocity[(column - m) * stride + r],
    };
    let states = DMatrix::from_fn(2 * m, 2 * stride, |row, c| match c < stride {
        true => superposed(row, c).re,
        false => -superposed(row, c - stride).im,
    });
    let modes = DMatrix::from_fn(2 * stride, 2 * m, |c, column| match c < stride {
        true => projected(c, column).re,
        false => projected(c - stride, column).im,
    });
    let missing = DMatrix::identity(2 * m, 2 * m) - states * &modes;
    let change = modes * missing;
    for k in 0..m {
        for r in 0..stride {
            let of =
                |column: usize| Complex64::new(change[(r, column)], change[(stride + r, column)]);
            from_position[k * stride + r] += of(k);
            from_velocity[k * stride + r] += of(m + k);
        }
    }
}

/// What belongs to each group and each term of its sums: for every `abreast` groups, for each term, of each of these groups.
fn in_blocks<T>(
    groups: usize,
    abreast: usize,
    terms: usize,
    of: impl Fn(usize, usize) -> T,
) -> Vec<T> {
    let of = &of;
    let blocks = (0..groups).step_by(abreast).map(|first| first..groups.min(first + abreast));
    blocks
        .flat_map(|block| {
            (0..terms).flat_map(move |term| block.clone().map(move |group| of(group, term)))
        })
        .collect()
}
