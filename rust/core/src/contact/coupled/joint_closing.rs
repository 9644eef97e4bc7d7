//! The end of a series of impacts over several contacts that mass couples.

use nalgebra::DMatrix;

use crate::contact::coupled::contacts::{Coupled, Resting};
use crate::contact::settlement::Series;
use crate::error::run::RunFailure;
use crate::linalg::dense::{apply, solve};
use crate::numerics::singular_values::pseudo_inverse;
use crate::scene::contact_law::Directions;
use crate::scene::model::Scene;
use crate::scene::status::Status;

/// The end of a series of impacts over several contacts.
#[derive(Debug)]
pub(crate) struct JointClosing {
    pub contacts: Vec<usize>,
    /// Duration of the rest of the series, s, which is left out: a geometric series that begins with the longest possible
    /// flight.
    pub rest: f64,
}

/// The first, quick selection takes the load larger by this factor, so that it drops no contact that the exact one keeps.
const MARGIN: f64 = 4.0;

/// Ends a series of impacts in which contacts lift each other, by closing all of them at once.
///
/// Let N be the normal forces of the contacts when all of them are closed. While they fly, their gaps move as
/// under the constant load -N, with the kinetic energy `1/2 v' W^-1 v` of their normal velocities v, and impacts
/// only take energy away: of `E = 1/2 v' W^-1 v + N g` nothing comes back. So no gap exceeds `E / N_i` from here
/// on, and no flight lasts longer than `sqrt(8 E / W_ii) / N_i`. Once all gaps stay below the resolution of the series,
/// which is far above their rounding, the impacts that follow are taken together:
/// they end with g = v = 0, so that their impulses are those of N over the rest of the series and the impulse that
/// takes v away. That one is given here, with its friction, and N acts from now on: after the rest velocities are
/// the same, and positions differ by those gaps. The same closing takes the place of a series whose rest is
/// `negligible`.
///
/// The rest is that of rounds in which every contact strikes once. Its impact with the speed v takes
/// `(1 - e^2) v^2 / (2 W_ii)` of an energy of at most `|v|^2 / (2 lambda)`, lambda being the least eigenvalue of W, so a round
/// takes the part `phi = (1 - e^2) lambda / max W_ii`. Flights go with the root of the energy: the rest is
/// `flight / (1 - sqrt(1 - phi))`, and `flight / (1 - e)` of one contact alone.
///
/// The impacts of one contact alone end at their own limit, since a gap is exact after a bounce. Where an event of
/// another contact has `broken` the flight, it is not: then they end here, too.
pub(crate) fn close_jointly(
    coupled: &Coupled<'_>,
    struck: &[usize],
    closed: &[usize],
    broken: bool,
    series: &Series,
    q: &mut [f64],
    u: &mut [f64],
) -> Result<Option<JointClosing>, RunFailure> {
    let contacts = &coupled.scene.contacts;
    let w = |i: usize, j: usize| coupled.w[(2 * i + 1, 2 * j + 1)];
    let resolution = series.resolution;
    let resting = |i: usize, u: &[f64]| closed.contains(&i) && u[contacts[i].normal] == 0.0;
    let near = |i: usize, load: f64| {
        let (gap, speed) = (contacts[i].gap_at(q), u[contacts[i].normal].abs());
        let soon = series.negligible * w(i, i) * load;
        let low = gap <= resolution && speed * speed <= w(i, i) * load * resolution;
        low || gap <= soon * series.negligible && speed <= soon
    };
    let others = (0..contacts.len()).filter(|i| !struck.contains(i) && !resting(*i, u));
    if !broken && struck.len() + others.count() < 2 {
        return Ok(None);
    }
    let load = MARGIN * coupled.reactions(q, u).chunks_exact(2).map(|r| r[1].abs()).sum::<f64>();
    let mut moving: Vec<usize> =
        (0..contacts.len()).filter(|&i| !resting(i, u) && near(i, load)).collect();
    while !moving.is_empty() && (broken || moving.iter().chain(struck).any(|i| *i != moving[0])) {
        let joined: Vec<usize> =
            (0..contacts.len()).filter(|&i| resting(i, u) || moving.contains(&i)).collect();
        let Resting { position, problem, solution, .. } = coupled.resting(&joined, q, u)?;
        let pressed: Vec<(usize, f64)> = problem
            .iter()
            .enumerate()
            .filter(|(k, (i, _))| {
                let opens = contacts[*i].directions != Directions::Tangential;
                opens && solution.statuses[*k].is_closed()
            })
            .map(|(k, &(i, _))| (i, solution.forces[2 * k + 1]))
            .collect();
        let count = moving.len();
        moving.retain(|i| pressed.iter().any(|(j, _)| j == i));
        if moving.len() < count {
            continue;
        }
        let mass =
            DMatrix::from_fn(pressed.len(), pressed.len(), |i, j| w(pressed[i].0, pressed[j].0));
        let speeds: Vec<f64> = pressed.iter().map(|&(i, _)| u[contacts[i].normal]).collect();
        let lightest = mass.diagonal().max();
        let dependent = coupled.scene.has_dependent_directions();
        let values = mass.symmetric_eigenvalues();
        // A direction that depends on others has no mass of its own.
        let least = values.iter().filter(|&&value| !dependent || value > 1e-10 * lightest);
        let part = least.copied().fold(f64::INFINITY, f64::min).max(0.0) / lightest;
        let momenta = match dependent {
            true => apply(&pseudo_inverse(&mass), &speeds),
            false => solve(mass, &speeds),
        };
        let kinetic: f64 = momenta.iter().zip(&speeds).map(|(p, v)| 0.5 * p * v).sum();
        let lifted: f64 = pressed.iter().map(|&(i, n)| n * contacts[i].gap_at(q).max(0.0)).sum();
        let energy = kinetic + lifted;
        let flight = |i: usize, n: f64| (8.0 * energy / w(i, i)).sqrt() / n;
        let rest = |i: usize, n: f64| {
            let taken = (1.0 - contacts[i].restitution.powi(2)) * part;
            flight(i, n) * (1.0 + (1.0 - taken).sqrt()) / taken
        };
        // The flight of a contact at this speed is shorter than the clock resolves.
        let unresolved = |i: usize, speed: f64| speed.abs() <= series.ulp * w(i, i) * load;
        // A closed contact that only the rounding of impulses moves had never opened.
        let shaken = |i: usize| {
            closed.contains(&i) && !struck.contains(&i) && unresolved(i, u[contacts[i].normal])
        };
        let members: Vec<(usize, f64)> = pressed
            .iter()
            .filter(|(i, _)| (moving.contains(i) && !shaken(*i)) || struck.contains(i))
            .map(|&(i, n)| (i, rest(i, n)))
            .collect();
        let rest = members.iter().map(|member| member.1).fold(0.0, f64::max);
        let moved = pressed.iter().filter(|entry| moving.contains(&entry.0));
        if rest > series.negligible && !moved.clone().all(|&(_, n)| energy <= n * resolution) {
            // The contact that alone would rise highest is left out first: it may hold all of the energy.
            let height = |&(i, n): &(usize, f64)| {
                let (gap, speed) = (contacts[i].gap_at(q), u[contacts[i].normal]);
                gap.max(0.0) + 0.5 * speed * speed / (w(i, i) * n)
            };
            let highest = moved.clone().max_by(|a, b| height(a).total_cmp(&height(b)));
            moving.retain(|&i| highest.is_none_or(|entry| entry.0 != i));
            continue;
        }
        let Some(mut held) = coupled.held(&problem, &solution.statuses, u) else {
            return Ok(None);
        };
        // The closing draws other contacts that touch onto their sliders, and they strike.
        let mut touching: Vec<usize> = closed.iter().chain(&joined).copied().collect();
        touching.sort_unstable();
        touching.dedup();
        for &i in &touching {
            let velocity = &mut held[contacts[i].normal];
            if *velocity < 0.0 && unresolved(i, *velocity) {
                *velocity = 0.0;
            }
        }
        if touching.iter().any(|&i| held[contacts[i].normal] < 0.0) {
            coupled.strike(&touching, &position, &mut held)?;
        }
        q.copy_from_slice(&position);
        u.copy_from_slice(&held);
        let contacts: Vec<usize> = members.into_iter().map(|member| member.0).collect();
        return Ok((!contacts.is_empty()).then_some(JointClosing { contacts, rest }));
    }
    Ok(None)
}

/// The statuses of contacts that mass couples once all of `contacts` touch and rest in their normal directions.
pub(crate) fn at_rest(
    scene: &Scene,
    contacts: &[usize],
    q: &[f64],
    u: &[f64],
) -> Result<Vec<Status>, RunFailure> {
    let Some(w) = &scene.coordinates.delassus else { return Ok(Vec::new()) };
    Ok(Coupled { scene, time: 0.0, w }.resting(contacts, q, u)?.solution.statuses)
}
