//! A norm in which differences of two motions with bristles grow slowly, however fast these relax.
//!
//! The state u_c of bristles and the velocities u of what they push obey
//!
//! ```text
//! u' = A_u (q, u, u_c) + a_u y,   u_c' = A_c (q, u, u_c) + a_c y,   y = mu(S) Z,   a_c < 0
//! ```
//!
//! with S the slip speed and Z the deflection, in proportion to u_c. y is large and relaxes u_c fast, but `w = u - (a_u / a_c) u_c` does not
//! feel it. In the norm `max(omega |q|, |w|, W |u_c|)` over mass-weighted coordinates, differences grow by the largest row sum with the
//! sign of the diagonal, the logarithmic norm (Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, I.10)
//!
//! ```text
//! max(S + beta / W,  W gamma - lambda),   gamma = |A_c + a_c mu' Z dS/du| + ..,   lambda = -(A_cc + a_c (mu' Z dS/du_c + mu Z/u_c))
//! ```
//!
//! where S is the largest row sum of A in (q, w) and beta that of its columns of u_c. In steady slip `mu' Z` takes back what slip adds to u_c, so
//! that gamma nearly vanishes, and in stick mu does. Both parts are equal for
//!
//! ```text
//! W = (S + lambda + sqrt((S + lambda)^2 + 4 gamma beta)) / (2 gamma)
//! ```

use std::collections::BTreeMap;

use crate::linalg::sparse::SparseMatrix;
use crate::motion::friction::series::law_contact::LawContact;
use crate::motion::taylor::operator::TaylorOperator;
use crate::numerics::interval::Interval;
use crate::scene::model::Scene;

/// Rounding of a few sums and products, relative to them.
const ROUNDED: f64 = 1e-9;

/// One row of an equation, by column.
type Row = BTreeMap<usize, f64>;

/// The norm of a combination.
#[derive(Debug)]
pub(super) struct StateNorm {
    /// S and beta, 1/s.
    others: f64,
    by_states: f64,
    /// `|u| <= (1 + spread / W) |(w, u_c)|`, and `|w| <= (1 + pushed) |(u, u_c)|`.
    spread: f64,
    pushed: f64,
    /// By contact that slides by its law; none of those without bristles.
    states: Vec<Option<StateRow>>,
}

/// The row of the bristles of a contact.
#[derive(Debug)]
pub(super) struct StateRow {
    /// The coordinate whose velocity is u_c.
    pub coordinate: usize,
    /// a_c, and the norm per u_c.
    pub acceleration: f64,
    pub weight: f64,
    /// What has nothing to do with slip, and (A_c, dS/du) of the velocities that make it, in the norm.
    rest: f64,
    by_slip: Vec<[f64; 2]>,
    /// A_cc, dS/du_c, and Z / u_c.
    own: [f64; 2],
    pub deflection: f64,
}

/// How differences of a state grow: gamma and lambda.
#[derive(Debug, Clone, Copy)]
pub(super) struct Relaxation {
    gained: f64,
    lost: f64,
}

impl StateRow {
    /// The rate at which u_c relaxes beside mu, 1/s.
    pub fn rate(&self, mu: f64) -> f64 {
        -self.acceleration * self.deflection * mu
    }

    /// The norm per unit of y.
    pub fn force_norm(&self) -> f64 {
        self.weight * self.acceleration.abs()
    }

    /// From the slope `mu' Z` of y over the slip speed and the least mu on the panel.
    pub fn relaxation(&self, slope: Interval, least: f64) -> Relaxation {
        let ends = [slope.low, slope.high].map(|slope| self.acceleration * slope);
        let worst = |[base, by_slip]: [f64; 2]| {
            ends.map(|end| base + end * by_slip).into_iter().fold(f64::NEG_INFINITY, f64::max)
        };
        let of_slip =
            |&[base, by_slip]: &[f64; 2]| worst([base, by_slip]).max(worst([-base, -by_slip]));
        let gained = self.rest + self.by_slip.iter().map(of_slip).sum::<f64>();
        let own = worst(self.own) + self.acceleration * self.deflection * least;
        Relaxation { gained: gained * (1.0 + ROUNDED), lost: -own - ROUNDED * own.abs() }
    }
}

impl StateNorm {
    /// None where no bristles relax, and where the norm is not the largest entry of a state.
    /// `scene` has the mass and the matrices of the combination.
    pub fn new(
        [whole, scene]: [&Scene; 2],
        taylor: &TaylorOperator,
        contacts: &[LawContact],
    ) -> Option<Self> {
        let equation = &taylor.equation;
        let reduction = &equation.reduction;
        let relaxes = |one: &LawContact| one.deflection(whole).is_some();
        if scene.coupled_mass.is_some()
            || !equation.creeping().is_empty()
            || !contacts.iter().any(relaxes)
        {
            return None;
        }
        let omega = taylor.omega();
        let weight = |k: usize| taylor.weight_of(k) / omega;
        let moves = |k: usize| reduction.place(k).is_some();
        let row = |i: usize, matrix: &SparseMatrix| -> Row {
            let mass = scene.mass.get(reduction.kept[i], reduction.kept[i]);
            let mut sums = Row::new();
            for (source, factor) in reduction.sources(i) {
                for (k, value) in matrix.row(source).filter(|entry| moves(entry.0)) {
                    *sums.entry(k).or_default() -= factor * value / mass;
                }
            }
            sums
        };
        let count = 0..reduction.kept.len();
        let mut rows: BTreeMap<usize, [Row; 2]> = count
            .map(|i| (reduction.kept[i], [row(i, &scene.stiffness), row(i, &scene.damping)]))
            .collect();
        // By bristles: u_c with Z / u_c, a_c, and a_u / a_c by coordinate.
        let pushes: Vec<Option<(usize, [f64; 2], Row)>> = contacts
            .iter()
            .map(|one| {
                let (state, deflection) = one.deflection(whole)?;
                let of =
                    |&(k, weight): &(usize, f64)| (k, one.sign * weight / scene.mass.get(k, k));
                let mut push: Row = one.direction.iter().map(of).collect();
                let own = push.remove(&state)?;
                push.values_mut().for_each(|a| *a /= own);
                Some((state, [own, deflection], push))
            })
            .collect();
        let pushes_of = || pushes.iter().flatten();
        let is_state = |k: usize| pushes_of().any(|(state, ..)| *state == k);
        for (state, _, push) in pushes_of() {
            let own = rows.get(state)?.clone();
            for (k, b) in push {
                for (into, from) in rows.get_mut(k)?.iter_mut().zip(&own) {
                    from.iter().for_each(|(&j, a)| *into.entry(j).or_default() -= b * a);
                }
            }
        }
        // u = w + (a_u / a_c) u_c
        let along = |row: &Row, push: &Row| -> f64 {
            push.iter().map(|(k, b)| row.get(k).map_or(0.0, |a| a * b)).sum()
        };
        for [_, row] in rows.values_mut() {
            for (state, _, push) in pushes_of() {
                let by_state = along(row, push);
                *row.entry(*state).or_default() += by_state;
            }
        }
        let in_norm = |row: usize, sums: &Row, rate: f64, keep: &dyn Fn(usize) -> bool| -> f64 {
            let terms = sums.iter().filter(|(k, _)| keep(**k));
            weight(row) * terms.map(|(&k, a)| a.abs() / (rate * weight(k))).sum::<f64>()
        };
        let is_other = |k: usize| !is_state(k);
        let spread_of = |k: usize| -> f64 {
            let terms = pushes_of()
                .filter_map(|(state, _, push)| Some(push.get(&k)?.abs() / weight(*state)));
            weight(k) * terms.sum::<f64>()
        };
        let (mut others, mut by_states, mut spread) = (omega, 0.0_f64, 0.0_f64);
        for (&k, [by_place, by_velocity]) in rows.iter().filter(|(k, _)| is_other(**k)) {
            let sum =
                in_norm(k, by_place, omega, &|_| true) + in_norm(k, by_velocity, 1.0, &is_other);
            others = others.max(sum);
            by_states = by_states.max(in_norm(k, by_velocity, 1.0, &is_state));
            spread = spread.max(spread_of(k));
        }
        // The place of u_c means nothing.
        by_states = by_states.max(omega * spread);
        let pushed = pushes_of().flat_map(|(state, _, push)| {
            push.iter().map(|(&k, b)| weight(k) * b.abs() / weight(*state))
        });
        let pushed = pushed.fold(0.0, f64::max);
        let states = contacts.iter().zip(&pushes).map(|(one, own)| {
            let (state, [acceleration, deflection], push) = own.as_ref()?;
            let [by_place, by_velocity] = &rows[state];
            let slip: Row = one.slip.velocity.iter().map(|&(k, w)| (k, -one.sign * w)).collect();
            let is_rest = |k: usize| k != *state && !slip.contains_key(&k);
            let scaled = |k: usize, a: f64| weight(*state) * a / weight(k);
            let by_slip = slip.iter().map(|(&k, &w)| {
                let base = by_velocity.get(&k).copied().unwrap_or(0.0);
                [scaled(k, base), scaled(k, w)]
            });
            let of_slip: f64 = along(&slip, push);
            Some(StateRow {
                coordinate: *state,
                acceleration: *acceleration,
                weight: weight(*state),
                rest: in_norm(*state, by_place, omega, &|_| true)
                    + in_norm(*state, by_velocity, 1.0, &is_rest),
                by_slip: by_slip.collect(),
                own: [by_velocity.get(state).copied().unwrap_or(0.0), of_slip],
                deflection: *deflection,
            })
        });
        let states: Vec<Option<StateRow>> = states.collect();
        Some(Self { others, by_states, spread, pushed, states })
    }

    /// The row of the bristles of a contact.
    pub fn state(&self, contact: usize) -> Option<&StateRow> {
        self.states[contact].as_ref()
    }

    /// Those of all contacts.
    pub fn rows(&self) -> impl Iterator<Item = Option<&StateRow>> {
        self.states.iter().map(Option::as_ref)
    }

    /// S
    pub fn others(&self) -> f64 {
        self.others
    }

    /// The largest of `|u|` over the norm, which W >= 1 does not enlarge.
    pub fn spread(&self) -> f64 {
        1.0 + self.spread
    }

    /// The growth of differences, 1/s, W, and what a defect of the equation counts at most, from what other laws add to S. W is no
    /// larger than what takes the growth over the width of the panel to one.
    pub fn growth(&self, added: f64, states: &[Relaxation], width: f64) -> [f64; 3] {
        let others = self.others + self.spread() * added;
        let weight_of = |one: &Relaxation| {
            let sum = others + one.lost;
            let root = (sum * sum + 4.0 * one.gained * self.by_states).sqrt();
            // No difference of numbers of about the same size.
            match sum > 0.0 {
                true => (sum + root) / (2.0 * one.gained),
                false => 2.0 * self.by_states / (root - sum),
            }
        };
        let weight = states.iter().map(weight_of).fold(self.by_states * width, f64::min).max(1.0);
        let of_states = states.iter().map(|one| weight * one.gained - one.lost);
        let growth = of_states.fold(others + self.by_states / weight, f64::max);
        [growth, weight, weight.max(1.0 + self.pushed)]
    }
}
