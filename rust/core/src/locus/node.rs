//! The modes at one parameter value, and which of another value continue them.
//!
//! Two neighbouring points are joined by the correlation of left and right vectors,
//! `v_r' ((lambda_r + lambda_s) M + C) xi_s / sqrt(a_r a_s)`, which is 1 or 0 for the modes of one point (it is
//! `left' A right` of the state vectors) and stays near 1 or 0 as long as the points are near each other.

use num_complex::Complex64;

use crate::error::input::Error;
use crate::linalg::eigenpair::turned;
use crate::locus::parameter_path::{Expansion, Path};
use crate::locus::watched_path::WatchedPath;
use crate::modes::complex_modes::normalised;
use crate::modes::mode::Mode;
use crate::modes::quadratic_pencil::{DoubledRows, PencilDamping};
use crate::modes::refinement::columns::Columns;
use crate::modes::spectrum::{Vectors, spectrum};

/// Least square of the correlation with the mode that continues a mode, and largest square with any other mode.
const KEPT: f64 = 0.5;
const OTHERS: f64 = 0.25;
/// Closer than this, two well-conditioned eigenvalues count as equal: their vectors are an arbitrary basis of a plane,
/// which cannot be tracked.
const TWINS: f64 = 1e-9;
/// Condition number up to which two eigenvalues that near are a semisimple pair and not nearly defective.
const SEMISIMPLE: f64 = 1e3;
/// Places at which an interval is divided: its middle, unless twins happen to lie there.
const DIVISIONS: [f64; 3] = [0.5, 0.4375, 0.5625];
/// Ulps below which a real part has no sign.
const NEUTRAL: f64 = 64.0 * f64::EPSILON;
/// Square of the correlation below which two modes are uncoupled, with a margin to its rounding of 1e-32.
pub(crate) const UNCOUPLED: f64 = 1e-22;

/// The modes at one parameter value, of each conjugate pair the one with positive imaginary part. Vectors are scaled to
/// a largest entry of 1: a correlation of two modes depends on how each is shared between its right and left vector.
#[derive(Debug, Default)]
pub(crate) struct Node {
    pub value: f64,
    pub modes: Vec<Mode>,
    /// `d lambda / d p` of each mode.
    pub slopes: Vec<Complex64>,
    /// Whether each mode grows by more than rounding.
    pub unstable: Vec<bool>,
    /// `|a|` of each mode.
    sizes: Vec<f64>,
    /// `M xi` of all modes, then `C xi`.
    products: Columns,
    /// Whether both vectors of a mode are real: of proportional damping they are, until two modes lock in.
    real: Vec<bool>,
    /// Whether damping is proportional and takes energy from every velocity or elastic force.
    is_damped: bool,
}

/// An eigenvalue among all: a mode of the node, or its conjugate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Member {
    pub mode: usize,
    pub conjugate: bool,
}

impl Node {
    pub fn new(path: WatchedPath<'_>, value: f64) -> Result<Self, Error> {
        path.begin_eigenproblem()?;
        let pencil = path.pencil(value);
        let mut modes = spectrum(&pencil, Vectors::Solved)?;
        modes.sort_by(|p, q| {
            let key = |mode: &Mode| (mode.eigenvalue.norm_sqr(), mode.eigenvalue.re);
            let (p, q) = (key(p), key(q));
            p.0.total_cmp(&q.0).then(p.1.total_cmp(&q.1))
        });
        modes = modes.into_iter().map(normalised).collect();
        let products = |rows: &DoubledRows| -> Vec<Complex64> {
            let mut all = Vec::with_capacity(modes.len() * pencil.size);
            modes.iter().for_each(|mode| all.extend(rows.rounded_product(&mode.right)));
            all
        };
        let real: Vec<bool> =
            modes.iter().map(|mode| is_real(&mode.right) && is_real(&mode.left)).collect();
        let mass = products(&pencil.mass);
        let damping = match &pencil.damping {
            PencilDamping::General(rows) => products(rows),
            PencilDamping::Proportional { alpha, beta } => {
                let mut stiffness = products(&pencil.stiffness);
                stiffness.iter_mut().zip(&mass).for_each(|(k, m)| *k = alpha * m + beta * *k);
                stiffness
            }
        };
        let columns = |all| <[Complex64]>::chunks_exact(all, pencil.size.max(1)).zip(&real);
        let both = columns(&mass).chain(columns(&damping)).map(|(column, &real)| (column, !real));
        let moved = moved_entries(&path, value);
        Ok(Self {
            value,
            slopes: modes.iter().map(|mode| slope(mode, &moved)).collect(),
            unstable: modes
                .iter()
                // Most decay, which needs no bound.
                .map(|m| m.eigenvalue.re > 0.0 && m.growth_sign(m.rounding(&pencil)) > 0.0)
                .collect(),
            sizes: modes.iter().map(|mode| mode.a.norm()).collect(),
            products: Columns::new(pencil.size, both),
            real,
            is_damped: matches!(
                pencil.damping,
                PencilDamping::Proportional { alpha, beta } if alpha >= 0.0 && beta >= 0.0
            ),
            modes,
        })
    }

    /// A node that divides the interval between two others, without twins if that is possible; None where no number
    /// is left between them.
    pub fn between(path: WatchedPath<'_>, from: &Node, to: &Node) -> Result<Option<Self>, Error> {
        let mut division = None;
        for part in DIVISIONS {
            let value = from.value + part * (to.value - from.value);
            if from.value < value && value < to.value {
                let node = Node::new(path, value)?;
                let clear = !node.has_twins();
                division = Some(node);
                if clear {
                    break;
                }
            }
        }
        Ok(division)
    }

    /// All eigenvalues, conjugates adjacent, positive imaginary part first.
    pub fn members(&self) -> Vec<Member> {
        let mut members = Vec::with_capacity(2 * self.modes.len());
        for (mode, entry) in self.modes.iter().enumerate() {
            members.push(Member { mode, conjugate: false });
            if !entry.is_real() {
                members.push(Member { mode, conjugate: true });
            }
        }
        members
    }

    /// Of each member that it is not joined to any other.
    pub fn apart(&self) -> Vec<usize> {
        vec![usize::MAX; self.members().len()]
    }

    pub fn eigenvalue(&self, member: Member) -> Complex64 {
        turned(self.modes[member.mode].eigenvalue, member.conjugate)
    }

    /// Whether two modes have one eigenvalue but different vectors, which are then not determined.
    fn are_twins(&self, r: usize, s: usize) -> bool {
        let (p, q) = (&self.modes[r], &self.modes[s]);
        p.condition.max(q.condition) < SEMISIMPLE
            && (p.eigenvalue - q.eigenvalue).norm_sqr() <= TWINS * TWINS * p.eigenvalue.norm_sqr()
    }

    pub fn has_twins(&self) -> bool {
        // Modes are sorted by modulus, so twins are neighbours.
        (1..self.modes.len()).any(|s| self.are_twins(s - 1, s))
    }

    /// Squares of the correlations of the modes `rows` here with all modes there, row by row.
    fn correlations(&self, rows: &[usize], other: &Node) -> Vec<f64> {
        let size = other.modes.first().map_or(0, |mode| mode.right.len());
        let lefts = rows.iter().map(|&r| (&self.modes[r].left[..], !self.real[r]));
        let lefts = Columns::new(size, lefts);
        let (products, count) = (lefts.products(&other.products), other.modes.len());
        let correlation = |row: usize, s: usize| {
            let r = rows[row];
            let sum = self.modes[r].eigenvalue + other.modes[s].eigenvalue;
            let product = sum * products.get(row, false, s) + products.get(row, false, count + s);
            product.norm_sqr() / (self.sizes[r] * other.sizes[s])
        };
        let mut all = Vec::with_capacity(rows.len() * count);
        for row in 0..rows.len() {
            all.extend((0..count).map(|s| correlation(row, s)));
        }
        all
    }

    /// The decisive continuation of all modes, if there is one, and the correlations, row by row.
    pub fn continued(&self, other: &Node) -> (Option<Vec<usize>>, Vec<f64>) {
        if self.modes.len() != other.modes.len() {
            return (None, Vec::new());
        }
        let every: Vec<usize> = (0..self.modes.len()).collect();
        self.continued_modes(&every, other)
    }

    /// The decisive continuation of the modes `rows` among all modes of the other node, if there is one, and their
    /// correlations with all of them, row by row.
    pub fn continued_modes(&self, rows: &[usize], other: &Node) -> (Option<Vec<usize>>, Vec<f64>) {
        let (next, correlations) = self.decided_modes(rows, other);
        (next.into_iter().collect(), correlations)
    }

    /// For each of the modes `rows` the mode of the other node that continues it, None where that is not decisive, and
    /// their correlations with all of them, row by row.
    pub fn decided_modes(&self, rows: &[usize], other: &Node) -> (Vec<Option<usize>>, Vec<f64>) {
        let count = other.modes.len();
        let correlations = self.correlations(rows, other);
        let mut taken = vec![false; count];
        let decided = correlations.chunks_exact(count.max(1)).zip(rows).map(|(row, &r)| {
            let best = (0..count).fold(0, |best, s| if row[s] > row[best] { s } else { best });
            let same = |s: usize| s == best || other.are_twins(best, s);
            let kept: f64 = (0..count).filter(|&s| same(s)).map(|s| row[s]).sum();
            let decisive = (KEPT..=1.0 / KEPT).contains(&kept)
                && (0..count).all(|s| same(s) || row[s] <= OTHERS * kept)
                && self.modes[r].is_real() == other.modes[best].is_real();
            let free =
                if taken[best] { (0..count).find(|&s| !taken[s] && same(s)) } else { Some(best) };
            let free = free.filter(|_| decisive)?;
            taken[free] = true;
            Some(free)
        });
        (decided.collect(), correlations)
    }

    /// The two modes of the other node among which the modes `rows` here go on, and whether that is decisive.
    pub fn continued_by_two(&self, rows: &[usize], other: &Node) -> ([usize; 2], bool) {
        let count = other.modes.len();
        let correlations = self.correlations(rows, other);
        let total =
            |s: usize| -> f64 { (0..rows.len()).map(|k| correlations[k * count + s]).sum() };
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|&s, &t| total(t).total_cmp(&total(s)));
        let &[first, second, ref others @ ..] = &order[..] else { return ([0; 2], false) };
        let is_decisive = correlations.chunks_exact(count).all(|row| {
            let kept = row[first] + row[second];
            (KEPT..=1.0 / KEPT).contains(&kept) && others.iter().all(|&s| row[s] <= OTHERS * kept)
        });
        ([first, second], is_decisive)
    }

    /// Whether a mode of proportional damping has the shape of an undamped one: `lambda^2 + (alpha + beta kappa) lambda + kappa`
    /// has no imaginary roots with real kappa but for zero, unless a coefficient of damping is negative.
    pub fn is_damped_shape(&self, mode: usize) -> bool {
        self.is_damped && self.real[mode]
    }

    /// The error below which the real part of a mode has no sign: ulp, times condition times modulus. Verdicts ask
    /// [`Mode::rounding`] instead, which takes products of all matrices for every mode; a search brackets roots, and a sign
    /// left open here only moves the end of a bracket to the next node.
    pub fn uncertainty(&self, mode: usize) -> f64 {
        NEUTRAL * self.modes[mode].condition * self.modes[mode].eigenvalue.norm()
    }

    /// The sign of the real part of a mode, 0 within its uncertainty.
    pub fn growth_sign(&self, mode: usize) -> f64 {
        significant_sign(self.modes[mode].eigenvalue.re, self.uncertainty(mode))
    }

    /// Two coupled eigenvalues among the modes `rows`, by their places there, that do not keep their distance to within
    /// half of it, or one eigenvalue twice that does not keep its distance from its conjugate.
    pub fn drifting(
        &self,
        rows: &[usize],
        other: &Node,
        next: &[usize],
        correlations: &[f64],
    ) -> Option<(usize, usize)> {
        let count = other.modes.len();
        let value = |node: &Node, mode: usize| node.modes[mode].eigenvalue;
        (0..rows.len()).find_map(|k| {
            let r = rows[k];
            let (before, after) = (value(self, r), value(other, next[k]));
            if !self.modes[r].is_real() && !is_steady(before - before.conj(), after - after.conj())
            {
                return Some((k, k));
            }
            let keeps = |&l: &usize| {
                let s = rows[l];
                let coupling =
                    correlations[k * count + next[l]].max(correlations[l * count + next[k]]);
                coupling < UNCOUPLED
                    || self.are_twins(r, s)
                    || other.are_twins(next[k], next[l])
                    || is_steady(before - value(self, s), after - value(other, next[l]))
            };
            (0..k).find(|l| !keeps(l)).map(|l| (k, l))
        })
    }

    /// How near a mode r and a mode s, or its conjugate, come to a point where they meet: their distance, and the part
    /// of the parameter's way `width` at which its square would vanish if it went on as it goes here.
    pub fn approach(&self, r: usize, (s, conjugate): (usize, bool), width: f64) -> (f64, f64) {
        let difference = self.modes[r].eigenvalue - turned(self.modes[s].eigenvalue, conjugate);
        let slope = self.slopes[r] - turned(self.slopes[s], conjugate);
        let distance = difference.norm();
        (distance, distance / (2.0 * slope.norm() * width))
    }

    /// The members of `other` that continue the members here, given the continuation of modes.
    /// A mode that is not continued, `usize::MAX`, has members that aren't.
    pub fn members_of(&self, other: &Node, next: &[usize]) -> Vec<usize> {
        let mut position = vec![0; other.modes.len()];
        for (k, member) in
            other.members().iter().enumerate().filter(|(_, member)| !member.conjugate)
        {
            position[member.mode] = k;
        }
        self.members()
            .iter()
            .map(|member| match next[member.mode] {
                usize::MAX => usize::MAX,
                mode => position[mode] + usize::from(member.conjugate),
            })
            .collect()
    }

    /// Eigenvalues here, moved on along their slopes, joined to the nearest ones there, conjugates alike, from the pairs of
    /// members that are `wanted` and not joined in `next`; `usize::MAX` for those left over.
    pub fn nearest(
        &self,
        other: &Node,
        mut next: Vec<usize>,
        wanted: impl Fn(usize, usize) -> bool,
    ) -> Vec<usize> {
        let (here, there) = (self.members(), other.members());
        let mut taken = vec![false; there.len()];
        next.iter().filter(|&&j| j != usize::MAX).for_each(|&j| taken[j] = true);
        let mut candidates: Vec<(f64, usize, usize)> = Vec::new();
        for (i, &r) in here.iter().enumerate().filter(|(i, _)| next[*i] == usize::MAX) {
            let shift = self.slopes[r.mode] * (other.value - self.value);
            let shift = turned(shift, r.conjugate);
            // A defective mode has no slope.
            let predicted = self.eigenvalue(r) + if shift.is_finite() { shift } else { 0.0.into() };
            for (j, &s) in there.iter().enumerate().filter(|&(j, _)| !taken[j] && wanted(i, j)) {
                candidates.push(((predicted - other.eigenvalue(s)).norm(), i, j));
            }
        }
        candidates.sort_by(|p, q| p.0.total_cmp(&q.0));
        let mirror = |node: &Node, members: &[Member], k: usize| {
            if node.modes[members[k].mode].is_real() {
                k
            } else if members[k].conjugate {
                k - 1
            } else {
                k + 1
            }
        };
        for (_, i, j) in candidates {
            for (i, j) in [(i, j), (mirror(self, &here, i), mirror(other, &there, j))] {
                if next[i] == usize::MAX && !taken[j] {
                    next[i] = j;
                    taken[j] = true;
                }
            }
        }
        next
    }
}

/// Whether a distance changes by less than half of it.
pub(crate) fn is_steady(before: Complex64, after: Complex64) -> bool {
    (after - before).norm_sqr() <= 0.25 * before.norm_sqr().min(after.norm_sqr())
}

/// The sign of a value, 0 within its uncertainty.
pub(crate) fn significant_sign(value: f64, uncertainty: f64) -> f64 {
    if value.abs() > uncertainty { value.signum() } else { 0.0 }
}

fn is_real(vector: &[Complex64]) -> bool {
    vector.iter().all(|z| z.im == 0.0)
}

/// Row, column and the entries of M', C', K' where any of them differs from zero: most parameters move few.
type Moved = (usize, usize, [f64; 3]);

fn moved_entries(path: &Path, value: f64) -> Vec<Moved> {
    let Expansion { slopes: [mass, damping, stiffness], .. } = path.expansion(value);
    let places = (0..path.size).flat_map(|i| (0..path.size).map(move |j| (i, j)));
    let entries = places.map(|at| (at.0, at.1, [mass[at], damping[at], stiffness[at]]));
    entries.filter(|entry| entry.2 != [0.0; 3]).collect()
}

/// `d lambda / d p = -v' (lambda^2 M' + lambda C' + K') xi / a`
fn slope(mode: &Mode, moved: &[Moved]) -> Complex64 {
    let lambda = mode.eigenvalue;
    let square = lambda * lambda;
    let mut sum = Complex64::default();
    for &(i, j, [mass, damping, stiffness]) in moved {
        sum += mode.left[i] * (square * mass + lambda * damping + stiffness) * mode.right[j];
    }
    -sum / mode.a
}
