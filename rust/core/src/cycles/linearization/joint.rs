//! The joint closing of contacts that mass couples, for a motion and for its neighbours.
//!
//! A series of impacts in which contacts lift each other ends with all of its gaps g and their velocities v at zero
//! (see `transition`). It is one event of an orbit, at the impact from which on the order of the others is not in the
//! numbers: the gap of the contact that strikes then is its event function h, and the number of impacts before does not
//! matter. The jump consists of this impact and of the rest of the series. During that rest the contacts take the reactions
//! N of closed contacts and, in addition, impulses p that change the velocities by `M^-1 D p`. A contact that slides has
//! `p_t = sigma mu p_n` at every impact, or `p_t = 0` where impacts have no friction, so that the sums P of these impulses are
//! those that end the series:
//!
//! ```text
//! u_n + (W P)_n = 0,   P_t = sigma mu P_n   or, where it sticks,   s + (W P)_t = 0
//! ```
//!
//! Displacements follow from their first moment. Over the rest T of the series the gaps come from g to 0 although v is
//! gone: `0 = g + v T + W Q`, where `Q = int (T - t) p dt` has the same directions as P, while the motion that
//! has taken P at once moves by `v T + W P T`. They differ by R = Q - P T with
//!
//! ```text
//! g + (W R)_n = 0,   R_t = sigma mu R_n   or, where it sticks,   (W R)_t = 0
//! ```
//!
//! Gaps at the closing are below rounding, so `W R` moves nothing that a run shows, but those of a neighbour are as large
//! as its other displacements. T is in neither of the two: how early the closing comes is of no first-order effect on the
//! motion that follows. Both projections are linear, and Dg is their product with that of the impact. Its rows of the
//! gaps, of their velocities and of slips that stick are zero.

use nalgebra::DMatrix;

use crate::contact::coupled::joint_closing::at_rest;
use crate::error::input::Error;
use crate::error::run::RunFailure;
use crate::linalg::components::components;
use crate::linalg::dense::{Factors, SINGULAR, apply, smallest_relative_pivot};
use crate::numerics::singular_values::pseudo_inverse;
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};

/// An impulse on one contact.
pub(crate) struct Impulse {
    /// Whether the slip velocity is held; else P_t is `friction` times P_n.
    pub sticking: bool,
    pub friction: f64,
    /// How much P_t grows with the slip velocity before, where friction depends on it.
    pub faster: f64,
    /// The parts of a held slip velocity, and of the normal velocity, that the impulse takes away.
    pub lost: [f64; 2],
}

/// The changes of the (tangential, normal) velocities of all contacts by impulses, per velocity before.
pub(crate) fn response(w: &DMatrix<f64>, impulses: &[Option<Impulse>]) -> DMatrix<f64> {
    let count = 2 * impulses.len();
    let (mut conditions, mut given) =
        (DMatrix::identity(count, count), DMatrix::zeros(count, count));
    for (i, impulse) in impulses.iter().enumerate() {
        let (t, g) = (2 * i, 2 * i + 1);
        let held = impulse.as_ref();
        let sticking = held.filter(|impulse| impulse.sticking);
        for (row, lost) in
            [(t, sticking.map(|impulse| impulse.lost[0])), (g, held.map(|impulse| impulse.lost[1]))]
        {
            if let Some(lost) = lost {
                conditions.set_row(row, &w.row(row));
                given[(row, row)] = -lost;
            }
        }
        if let Some(impulse) = held.filter(|impulse| !impulse.sticking) {
            conditions[(t, g)] = -impulse.friction;
            given[(t, t)] = impulse.faster;
        }
    }
    // If directions depend on each other, the impulses are not determined, but their effect is.
    match smallest_relative_pivot(&conditions) < SINGULAR {
        true => w * (pseudo_inverse(&conditions) * given),
        false => w * Factors::new(conditions).solve(given),
    }
}

/// The rest of a series after its last impact: `y+ = projection (y - moving) + moving`.
pub(crate) struct Closing {
    pub projection: DMatrix<f64>,
    /// Velocities of the sliders to which contacts stick, over (q, q').
    moving: Vec<f64>,
}

impl Closing {
    /// Of the contacts `series`, in the state just after the impact of `struck`.
    pub fn new(
        scene: &Scene,
        before: &Combination,
        struck: usize,
        series: &[usize],
        state: &[f64],
    ) -> Result<Self, RunFailure> {
        let Some(w) = &scene.coordinates.delassus else {
            return Err(RunFailure::Input(Error::Shape {
                argument: "scene".into(),
                expected: "contacts coupled by mass, like those of the orbit".into(),
                got: "contacts that mass does not couple".into(),
            }));
        };
        let laws = &scene.contacts;
        let n = scene.size;
        let size = 2 * n;
        let (q, u) = state.split_at(n);
        let touches = |i: usize| i == struck || before.statuses()[i].is_closed();
        let joined: Vec<usize> = (0..laws.len())
            .filter(|i| series.contains(i) || touches(*i) && u[laws[*i].normal] == 0.0)
            .collect();
        let statuses = at_rest(scene, &joined, q, u)?;
        let impulses = |level: usize| -> Vec<Option<Impulse>> {
            let mut impulses: Vec<Option<Impulse>> = (0..laws.len()).map(|_| None).collect();
            for (&i, &status) in joined.iter().zip(&statuses).filter(|pair| pair.1.is_closed()) {
                impulses[i] = Some(Impulse {
                    sticking: status == Status::Sticking,
                    friction: match scene.impacts_rub() {
                        true => status.friction_sign() * scene.friction_at(i, u),
                        false => 0.0,
                    },
                    // The impulses of the rest vanish.
                    faster: 0.0,
                    // A contact that sticks keeps its place.
                    lost: [level as f64, 1.0],
                });
            }
            impulses
        };
        let rows: Vec<usize> = laws.iter().flat_map(|law| [law.tangential, law.normal]).collect();
        let mut projection = DMatrix::identity(size, size);
        for level in [0, 1] {
            let change = response(w, &impulses(level));
            for (i, &row) in rows.iter().enumerate() {
                for (j, &column) in rows.iter().enumerate() {
                    projection[(level * n + row, level * n + column)] += change[(i, j)];
                }
            }
        }
        let mut moving = vec![0.0; size];
        let mut still = Vec::new();
        for (&i, &status) in joined.iter().zip(&statuses).filter(|pair| pair.1.is_closed()) {
            still.extend([laws[i].normal, n + laws[i].normal]);
            moving[laws[i].normal] = laws[i].closed();
            if status == Status::Sticking {
                still.push(n + laws[i].tangential);
                moving[n + laws[i].tangential] = laws[i].slider_speed;
            }
        }
        still.into_iter().for_each(|row| projection.row_mut(row).fill(0.0));
        let closing = Self { projection, moving };
        let mut after = state.to_vec();
        closing.close(&mut after);
        // The impulses must not draw a contact that has just lifted off into its slider: only the series itself is closed then.
        if (0..laws.len()).any(|i| touches(i) && after[n + laws[i].normal] < 0.0) {
            let mut projection = DMatrix::identity(size, size);
            let mut moving = vec![0.0; size];
            for law in series.iter().map(|&i| &laws[i]) {
                projection.row_mut(law.normal).fill(0.0);
                projection.row_mut(n + law.normal).fill(0.0);
                moving[law.normal] = law.closed();
            }
            return Ok(Self { projection, moving });
        }
        Ok(closing)
    }

    /// Takes a state to the end of the series.
    pub fn close(&self, state: &mut [f64]) {
        let apart: Vec<f64> = state.iter().zip(&self.moving).map(|(y, v)| y - v).collect();
        let closed = apply(&self.projection, &apart);
        state.iter_mut().zip(closed).zip(&self.moving).for_each(|((y, closed), v)| *y = closed + v);
    }
}

/// Contacts that mass couples to one contact, directly or through others, itself among them.
pub(crate) fn coupled_with(w: &DMatrix<f64>, contact: usize) -> Vec<usize> {
    let count = w.nrows() / 2;
    let tied = |i: usize, j: usize| w.view((2 * i, 2 * j), (2, 2)).iter().any(|&a| a != 0.0);
    components(count, |i, found| found.extend((0..count).filter(|&j| tied(i, j))))
        .into_iter()
        .find(|members| members.contains(&contact))
        .unwrap_or_default()
}
