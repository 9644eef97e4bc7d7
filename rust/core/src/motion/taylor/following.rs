//! What coordinates without mass do in one combination of a scene with a border.
//!
//! With their rows `d = K_ei q_i`, closed gaps at zero and sticking coordinates at their places q_s, those of a group are
//!
//! ```text
//! q_e = G d + R q_s + c,   -G = A^-1 L' over those that neither holds
//! ```
//!
//! (see [`crate::scene::massless::condensation`]), and they pull the others by `-K_ie q_e`. Where D of the border is the stiffness
//! while no contact acts on them, the others know `-Y d` of that, and feel `x = q_e + Y d`. Damping knows no contacts, so
//! that where D is `K_ii` the others feel `x = q_e - beta Y d'`. So d costs one product with the rows of the border, x
//! a product of the size of the group, and the pull another product with the rows.

use nalgebra::DMatrix;
use pulp::bytemuck::{cast_slice, cast_slice_mut};

use crate::motion::taylor::doubled_products::{LessDot, LessRow};
use crate::numerics::double_double::Doubled;
use crate::numerics::simd::{GROUP, Group, Lanes, VectorUnit, ZEROS, group};
use crate::scene::equation_of_motion::EquationOfMotion;
use crate::scene::inertia::border::{Border, FollowerRows, Followers};
use crate::scene::massless::condensation::{Condensed, Elimination};
use crate::scene::model::Scene;

/// Rows that are multiplied at once.
pub(super) const BLOCK: usize = 4;
/// The largest eigenvalue is bounded by the norm of A^(2^SQUARES) to the power 2^(-SQUARES), which is too large by at most the
/// 2^(SQUARES + 1)-th root of the order of A.
const SQUARES: usize = 3;
/// More than rounding adds up to in these products.
const ROUNDING: f64 = 1e-12;

#[derive(Debug)]
pub(super) struct Following {
    /// Groups that others feel.
    parts: Vec<Part>,
    reactions: Vec<Reaction>,
    /// `F - K_ie c`
    pub force: Vec<f64>,
}

/// One group.
#[derive(Debug)]
struct Part {
    /// Place of its first coordinate.
    first: usize,
    /// From d to x.
    pull: DMatrix<f64>,
    /// R, by sticking coordinate.
    held: Vec<(usize, Vec<f64>)>,
    /// Y, where damping is not that of the border.
    damped: Option<DMatrix<f64>>,
}

/// A row of K that is merged into others, `of d + held q_s`.
#[derive(Debug)]
struct Reaction {
    coordinate: usize,
    first: usize,
    of: Vec<f64>,
    held: Vec<(usize, f64)>,
}

/// Buffers by place.
#[derive(Debug, Default)]
pub(super) struct Places {
    dots: Vec<f64>,
    damped: Vec<f64>,
    x: Vec<f64>,
    exact: Vec<Doubled>,
}

impl Part {
    fn size(&self) -> usize {
        self.pull.nrows()
    }
}

impl Following {
    pub fn new(
        scene: &Scene,
        border: &Border,
        followers: &Followers,
        equation: &EquationOfMotion,
        condensed: &Condensed,
    ) -> Self {
        let mut force = scene.force.clone();
        let (mut parts, mut reactions) = (Vec::new(), Vec::new());
        for (index, group) in scene.massless.groups.iter().enumerate() {
            let count = group.coordinates.len();
            let eliminated = condensed.parts.iter().find(|part| part.group == index);
            let places = |k: usize| group.place(k);
            let y = &group.flexibility;
            let g = eliminated
                .map_or_else(|| DMatrix::zeros(count, count), |part| response(part, y, places));
            let mut held: Vec<(usize, Vec<f64>)> = Vec::new();
            for (k, place) in equation.reduction.held().filter_map(|k| Some((k, places(k)?))) {
                let mut column = vec![0.0; count];
                column[place] = 1.0;
                held.push((k, column));
            }
            let mut constant = vec![0.0; count];
            for (place, &k) in group.coordinates.iter().enumerate() {
                let Some(follower) = condensed.slaved.find(k) else { continue };
                constant[place] = follower.constant;
                for (s, column) in &mut held {
                    let of = follower.terms.binary_search_by_key(s, |term| term.0);
                    column[place] = of.map_or(0.0, |term| follower.terms[term].1);
                }
            }
            let first = followers.first[index];
            for (place, &c) in constant.iter().enumerate().filter(|(_, c)| **c != 0.0) {
                for (k, value) in followers.terms(first + place, border.groups) {
                    force[k] -= value * c;
                }
            }
            for merge in &equation.reduction.merges {
                let Some(place) = places(merge.normal) else { continue };
                let row: Vec<f64> = group
                    .coordinates
                    .iter()
                    .map(|&k| scene.stiffness.get(merge.normal, k))
                    .collect();
                let dot = |column: &[f64]| row.iter().zip(column).map(|(a, b)| a * b).sum::<f64>();
                force[merge.normal] -= dot(&constant);
                let own = |j: usize| if j == place { 1.0 } else { 0.0 };
                let of = (0..count).map(|j| own(j) + dot(g.column(j).as_slice())).collect();
                let held = held.iter().map(|(k, column)| (*k, dot(column))).collect();
                reactions.push(Reaction { coordinate: merge.normal, first, of, held });
            }
            let beside = g + y;
            let is_felt = beside.iter().any(|entry| *entry != 0.0) || !held.is_empty();
            let damped = (!followers.is_free && border.beta != 0.0).then(|| y.clone());
            if followers.is_free {
                let reacts = reactions.iter().any(|reaction| reaction.first == first);
                if is_felt || reacts {
                    parts.push(Part { first, pull: beside, held, damped });
                }
            } else {
                parts.push(Part { first, pull: beside - y, held, damped });
            }
        }
        Self { parts, reactions, force }
    }

    /// About how many numbers it holds.
    pub fn numbers(&self) -> usize {
        let part = |part: &Part| {
            let matrices = part.pull.len() + part.damped.as_ref().map_or(0, DMatrix::len);
            matrices + part.size() * part.held.len()
        };
        let reactions = self.reactions.iter().map(|reaction| reaction.of.len());
        self.parts.iter().map(part).chain(reactions).sum::<usize>() + self.force.len()
    }

    /// Bounds in the norm of M of what contacts add to the stiffness that the others have while none acts on these, and of
    /// what their merged rows add, 1/s^2.
    pub fn rates(
        &self,
        scene: &Scene,
        followers: &Followers,
        equation: &EquationOfMotion,
    ) -> [f64; 2] {
        let root = &followers.root;
        let count = followers.coordinates.len();
        let mut added = DMatrix::zeros(root.nrows(), count);
        for part in &self.parts {
            let index = followers.first.partition_point(|&first| first <= part.first) - 1;
            let y = &scene.massless.groups[index].flexibility;
            let beside = if followers.is_free { part.pull.clone() } else { &part.pull + y };
            let places = root.columns(part.first, part.size()) * beside;
            added.columns_mut(part.first, part.size()).copy_from(&places);
        }
        let added = added * root.transpose();
        let mut merged = 0.0;
        for (place, merge) in equation.reduction.merges.iter().map(|merge| (merge.position, merge))
        {
            let own = self.reactions.iter().filter(|of| of.coordinate == merge.normal);
            for Reaction { first, of, .. } in own {
                let k = equation.reduction.kept[place];
                let columns = root.columns(*first, of.len());
                let size = (columns * nalgebra::DVector::from_column_slice(of)).norm();
                // Every row has at most one merge.
                merged += (merge.factor * size).powi(2) / scene.mass.get(k, k);
            }
        }
        [largest(added.tr_mul(&added), SQUARES).sqrt() * (1.0 + ROUNDING), merged.sqrt()]
    }

    /// Adds `K_ie x` to `sum`; `still` holds q and `moved` `q + beta q'`.
    #[inline(always)]
    pub fn add<S: Lanes>(
        &self,
        simd: S,
        followers: &Followers,
        [still, moved]: [&[Group]; 2],
        sum: &mut [Group],
        places: &mut Places,
    ) {
        let q: &[f64] = cast_slice(still);
        let Places { dots, damped, x, .. } = places;
        let padded = followers.coordinates.len() + BLOCK;
        [&mut *dots, &mut *damped, &mut *x].into_iter().for_each(|of| of.resize(padded, 0.0));
        for part in &self.parts {
            let (first, count) = (part.first, part.size());
            let places = first..first + count;
            products(simd, followers, first, count, still, dots);
            let x = &mut x[..count.next_multiple_of(BLOCK)];
            x.fill(0.0);
            add_product(&part.pull, &dots[places.clone()], &mut x[..count]);
            for (k, column) in &part.held {
                x.iter_mut().zip(column).for_each(|(x, factor)| *x += factor * q[*k]);
            }
            if let Some(y) = &part.damped {
                products(simd, followers, first, count, moved, damped);
                for place in places {
                    damped[place] = dots[place] - damped[place];
                }
                add_product(y, &damped[first..first + count], &mut x[..count]);
            }
            add_rows(simd, followers, first, count, x, sum);
        }
    }

    /// Sets what the merged rows leave, without constants.
    pub fn react(&self, q: &[f64], places: &Places, residual: &mut [f64]) {
        for Reaction { coordinate, first, of, held } in &self.reactions {
            let dots = of.iter().zip(&places.dots[*first..]).map(|(a, d)| a * d).sum::<f64>();
            let held: f64 = held.iter().map(|&(k, factor)| factor * q[k]).sum();
            residual[*coordinate] = -dots - held;
        }
    }

    /// Subtracts `K_ie x` in doubled precision, of places alone, and sets the merged rows.
    pub fn balance(
        &self,
        unit: VectorUnit,
        followers: &Followers,
        moved: &[Group],
        [sum, low]: [&mut [Group]; 2],
        rows: &mut [Doubled],
        places: &mut Places,
    ) {
        let q: &[f64] = cast_slice(moved);
        let exact = &mut places.exact;
        exact.resize(followers.coordinates.len(), Doubled::default());
        for part in &self.parts {
            let (first, count) = (part.first, part.size());
            for place in first..first + count {
                exact[place] = match &followers.rows {
                    FollowerRows::Short(rows) => {
                        let products = rows[place].iter().map(|&(k, a)| Doubled::product(a, q[k]));
                        products.fold(Doubled::default(), Doubled::add)
                    }
                    FollowerRows::Long(_) => {
                        let row = cast_slice(followers.row(place, moved.len()));
                        unit.run(LessDot { sum: Doubled::default(), row, moved: q }).times(-1.0)
                    }
                };
            }
            for i in 0..count {
                let of = (0..count).map(|j| exact[first + j].times(part.pull[(i, j)]));
                let held = part.held.iter().map(|(k, column)| Doubled::product(column[i], q[*k]));
                let x = of.chain(held).fold(Doubled::default(), Doubled::add);
                match &followers.rows {
                    FollowerRows::Short(rows) => {
                        let (sum, low) = (cast_slice_mut(sum), cast_slice_mut(low));
                        for &(k, value) in &rows[first + i] {
                            let known = Doubled { high: sum[k], low: low[k] };
                            let found = known.add(x.times(-value));
                            (sum[k], low[k]) = (found.high, found.low);
                        }
                    }
                    FollowerRows::Long(_) => {
                        let row = followers.row(first + i, moved.len());
                        let by = [x.high, x.low];
                        unit.run(LessRow { row, by, sum: &mut *sum, low: &mut *low });
                    }
                }
            }
        }
        for Reaction { coordinate, first, of, held } in &self.reactions {
            let dots = of.iter().zip(&exact[*first..]).map(|(&a, d)| d.times(-a));
            let held = held.iter().map(|&(k, factor)| Doubled::product(-factor, q[k]));
            let force = Doubled::from(self.force[*coordinate]);
            rows[*coordinate] = dots.chain(held).fold(force, Doubled::add);
        }
    }
}

/// G of a group: what follows from its rows d.
fn response(
    part: &Elimination,
    flexibility: &DMatrix<f64>,
    place: impl Fn(usize) -> Option<usize>,
) -> DMatrix<f64> {
    let count = flexibility.nrows();
    // Without contacts nothing is to be left of `G + Y`.
    if part.coordinates.len() == count && part.sources.iter().all(|source| source.len() == 1) {
        return -flexibility;
    }
    let mut g = DMatrix::zeros(count, count);
    for (i, row) in part.coordinates.iter().map(|&k| place(k)).enumerate() {
        for (j, source) in part.sources.iter().enumerate() {
            for (column, factor) in source.iter().map(|&(k, factor)| (place(k), factor)) {
                if let (Some(row), Some(column)) = (row, column) {
                    g[(row, column)] -= factor * part.inverse[(i, j)];
                }
            }
        }
    }
    g
}

/// A bound of the largest eigenvalue of a symmetric matrix without negative ones: `l^2` is that of its square, and no norm is
/// below l.
fn largest(matrix: DMatrix<f64>, squares: usize) -> f64 {
    let norm = matrix.column_iter().map(|column| column.lp_norm(1)).fold(0.0, f64::max);
    if squares == 0 || norm == 0.0 || !norm.is_finite() {
        return norm;
    }
    let matrix = matrix / norm;
    norm * largest(&matrix * &matrix, squares - 1).sqrt()
}

/// `y += matrix x`
#[inline(always)]
fn add_product(matrix: &DMatrix<f64>, x: &[f64], y: &mut [f64]) {
    for (column, &x) in matrix.as_slice().chunks_exact(y.len()).zip(x) {
        for (y, &entry) in y.iter_mut().zip(column) {
            *y += entry * x;
        }
    }
}

/// Products of rows with a vector, by place.
#[inline(always)]
fn products<S: Lanes>(
    simd: S,
    followers: &Followers,
    first: usize,
    count: usize,
    x: &[Group],
    dots: &mut [f64],
) {
    match &followers.rows {
        FollowerRows::Short(rows) => {
            let x: &[f64] = cast_slice(x);
            for (dot, row) in dots[first..].iter_mut().zip(&rows[first..first + count]) {
                *dot = row.iter().fold(0.0, |sum, &(k, value)| sum + value * x[k]);
            }
        }
        FollowerRows::Long(_) => {
            for start in (first..first + count).step_by(BLOCK) {
                let of = followers.block::<BLOCK>(start, first + count, x.len());
                let mut sums = [ZEROS; BLOCK];
                for (g, &x) in x.iter().enumerate() {
                    for r in 0..BLOCK {
                        sums[r] = simd.mul_add_f64s(of[r][g], x, sums[r]);
                    }
                }
                for r in 0..BLOCK {
                    dots[start + r] = simd.reduce_sum_f64s(sums[r]);
                }
            }
        }
    }
}

/// `sum += rows' x`; x begins at `first` and has zeros up to whole blocks.
#[inline(always)]
fn add_rows<S: Lanes>(
    simd: S,
    followers: &Followers,
    first: usize,
    count: usize,
    x: &[f64],
    sum: &mut [Group],
) {
    match &followers.rows {
        FollowerRows::Short(rows) => {
            let sum: &mut [f64] = cast_slice_mut(sum);
            for (x, row) in x.iter().zip(&rows[first..first + count]) {
                row.iter().for_each(|&(k, value)| sum[k] += value * x);
            }
        }
        FollowerRows::Long(_) => {
            for (block, x) in x.chunks_exact(BLOCK).enumerate() {
                let of = followers.block::<BLOCK>(first + block * BLOCK, first + count, sum.len());
                let mut by = [ZEROS; BLOCK];
                for r in 0..BLOCK {
                    by[r] = group([x[r]; GROUP]);
                }
                for (g, sum) in sum.iter_mut().enumerate() {
                    for r in 0..BLOCK {
                        *sum = simd.mul_add_f64s(of[r][g], by[r], *sum);
                    }
                }
            }
        }
    }
}
