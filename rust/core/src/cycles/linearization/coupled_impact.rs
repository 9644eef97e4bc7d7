//! How the velocities after an impact follow those before it, where mass couples contacts.

use nalgebra::DMatrix;

use crate::cycles::linearization::joint::{Impulse, response};
use crate::linalg::dense::{impulses_of, max_norm, solve};
use crate::scene::model::Scene;
use crate::scene::status::Combination;

/// Part of the largest impulse below which a contact took none.
const NO_IMPULSE: f64 = 1e-12;

/// The rows of Dg of an impact that mass spreads over all closed contacts. What the impulses did says which
/// of their conditions hold: none, sticking (both velocities given) or sliding (`P_t = +-mu P_n`).
pub(crate) fn coupled_impact(
    scene: &Scene,
    w: &DMatrix<f64>,
    before: &Combination,
    struck: &[usize],
    end: &[f64],
    arrived: &[f64],
    matrix: &mut DMatrix<f64>,
) {
    let n = scene.size;
    let count = 2 * scene.contacts.len();
    let rows: Vec<usize> =
        scene.contacts.iter().flat_map(|law| [n + law.tangential, n + law.normal]).collect();
    let change: Vec<f64> = rows.iter().map(|&row| arrived[row] - end[row]).collect();
    let impulse = match scene.dependents.is_empty() {
        true => solve(w.clone(), &change),
        false => {
            let touches = |i: usize| struck.contains(&i) || before.statuses()[i].is_closed();
            let touching: Vec<usize> = (0..count).filter(|row| touches(row / 2)).collect();
            impulses_of(w, &touching, &change)
        }
    };
    let rubs = scene.impacts_rub();
    let largest = max_norm(&impulse);
    // Velocities that do not depend on what they were.
    let mut set = vec![false; count];
    let impulses: Vec<Option<Impulse>> = scene
        .contacts
        .iter()
        .enumerate()
        .map(|(i, law)| {
            let (t, g) = (2 * i, 2 * i + 1);
            let touching = struck.contains(&i) || before.statuses()[i].is_closed();
            let held = touching && impulse[g] > NO_IMPULSE * largest;
            let sticking = held && rubs && arrived[rows[t]] == law.slider_speed;
            (set[t], set[g]) = (sticking, held && law.restitution == 0.0);
            let direction = impulse[t].signum();
            let friction = if rubs { scene.friction_at(i, &end[n..]) * direction } else { 0.0 };
            let slip = (end[rows[t]] - law.slider_speed).signum();
            let slope = if rubs { scene.friction_slope(i, &end[n..]) } else { 0.0 };
            let faster = slope * slip * direction * impulse[g];
            held.then_some(Impulse {
                sticking,
                friction,
                faster,
                lost: [1.0, 1.0 + law.restitution],
            })
        })
        .collect();
    let velocity = response(w, &impulses);
    for (i, &row) in rows.iter().enumerate() {
        for (j, &column) in rows.iter().enumerate() {
            matrix[(row, column)] += velocity[(i, j)];
        }
        if set[i] {
            matrix.row_mut(row).fill(0.0);
        }
    }
}
