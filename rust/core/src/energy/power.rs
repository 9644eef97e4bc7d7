//! Energy and powers of a state, each from its own formula.
//!
//! ```text
//! E = 1/2 u' M u + 1/2 x' K x + sum_e int phi_e,      u = x'
//! dE/dt = sum_i T_i (t_i . u) + F . u - u' C u
//! ```
//!
//! (N_i g_i' = 0 while a contact is closed). With gyroscopic and circulatory terms, `(C + G) x'` and `(K + H) x`, the
//! power of G is `u' G u = 0`. Of H the symmetric part has the potential `1/2 x' H_s x`, so it belongs to the elastic
//! energy, `K + H_s` in place of K; the rest has none, and `-u' H_a x`, `H_a = (H - H') / 2`, is a term of its own on the
//! right. The left side is computed as `u' (M x'' + K x)` with x'' from the
//! reduced equation of motion, in which no contact force appears; the right side from the contact forces:
//! their agreement is a check. The contact power is the power on the structure, `T_i v_i` from the slider
//! less the friction heat `-T_i s_i >= 0`, `s_i = t_i . u - v_i`. Where v_i vibrates, it is the whole speed of the slider.
//! F holds the loads in time. By Archard's law a contact wears as the integral of its *wear power* `N_i |s_i|`,
//! in a plane of `N |w|`, of which a direction has the part `N w_i^2 / |w|`.

use crate::contact::contact_forces::ContactForces;
use crate::error::input::Error;
use crate::linalg::sparse::SparseMatrix;
use crate::scene::contact_law::Contact;
use crate::scene::equation_of_motion::EquationOfMotion;
use crate::scene::friction::contact_state::InState;
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};
use crate::transient::trajectory::model::Trajectory;
use crate::transient::trajectory::sampling::Cursor;

/// Energies, J, and powers, W, at a series of instants; row-major.
#[derive(Debug, Clone, Default)]
pub struct EnergySample {
    /// Kinetic energy `1/2 u' M u` of each instant, with u the velocities, J.
    pub kinetic: Vec<f64>,
    /// Elastic energy `1/2 x' K x` of each instant, J.
    pub elastic: Vec<f64>,
    /// dE/dt from the state equation.
    pub rate: Vec<f64>,
    /// Power of the force F and the loads in time at each instant, W; positive where it feeds the motion.
    pub external: Vec<f64>,
    /// Power of the circulatory forces on the structure, `-u' H_a x`, W.
    pub circulatory: Vec<f64>,
    /// Dissipated power, one column per damper group.
    pub damping: Vec<f64>,
    /// T_i (t_i . u), one column per contact.
    pub contact: Vec<f64>,
    /// T_i v_i, one column per contact.
    pub slider: Vec<f64>,
    /// N_i |s_i|, one column per contact; in a plane N w_i^2 / |w|.
    pub wear: Vec<f64>,
    /// Combination of each instant.
    pub combination: Vec<Combination>,
}

/// `1/2 u' M u` and `1/2 x' K x`.
pub(crate) fn energies(scene: &Scene, q: &[f64], u: &[f64]) -> (f64, f64) {
    let elastic = 0.5 * bilinear(elastic_stiffness(scene), q, q) + scene.element_energy(q);
    let [hidden, stored] = scene.hidden_energy(None, u);
    (0.5 * bilinear(&scene.mass, u, u) - hidden, elastic + stored)
}

/// Changes of kinetic and elastic energy between two states, `1/2 (u1 + u0)' M (u1 - u0)` and
/// `1/2 (x1 + x0)' K (x1 - x0)`: rounded relative to the change of the state, not to the energies.
pub(crate) fn energy_change(
    scene: &Scene,
    (q0, u0): (&[f64], &[f64]),
    (q1, u1): (&[f64], &[f64]),
) -> (f64, f64) {
    let half = |matrix: &SparseMatrix, a0: &[f64], a1: &[f64]| {
        let sum: Vec<f64> = a0.iter().zip(a1).map(|(a, b)| b + a).collect();
        let change: Vec<f64> = a0.iter().zip(a1).map(|(a, b)| b - a).collect();
        0.5 * bilinear(matrix, &sum, &change)
    };
    let elastic = half(elastic_stiffness(scene), q0, q1) + scene.element_energy_change(q0, q1);
    let [hidden, stored] = scene.hidden_energy(Some(u0), u1);
    (half(&scene.mass, u0, u1) - hidden, elastic + stored)
}

/// K with the symmetric part of H: the matrix of the elastic energy.
fn elastic_stiffness(scene: &Scene) -> &SparseMatrix {
    scene.energy_parts.as_ref().map_or(&scene.stiffness, |parts| &parts.elastic)
}

/// `-H_a x` at positions q, the circulatory force that no potential has; None where there is no such force.
pub(crate) fn circulatory_force(scene: &Scene, q: &[f64]) -> Option<Vec<f64>> {
    let matrix = antisymmetric(scene)?;
    let mut force = vec![0.0; scene.size];
    matrix.add_product(-1.0, q, &mut force);
    Some(force)
}

/// `H_a = (H - H') / 2`
pub(crate) fn antisymmetric(scene: &Scene) -> Option<&SparseMatrix> {
    let parts = scene.energy_parts.as_ref()?;
    Some(&parts.antisymmetric).filter(|matrix| matrix.entries() > 0)
}

/// Names of the damper groups: `mass` and `stiffness` where `C + G = alpha M + beta (K + H)`, else `dampers`.
pub fn damper_groups(scene: &Scene) -> &'static [&'static str] {
    if scene.bare().proportional.is_some() { &["mass", "stiffness"] } else { &["dampers"] }
}

/// Dissipated power per damper group, `alpha u' M u` and `beta u' K u`, or `u' C u` with what nonlinear dampers take.
pub(crate) fn damping_powers(scene: &Scene, q: &[f64], u: &[f64]) -> [f64; 2] {
    let form = |factor: f64, matrix: &SparseMatrix| {
        if factor == 0.0 { 0.0 } else { factor * bilinear(matrix, u, u) }
    };
    match scene.proportional {
        Some((alpha, beta)) => [form(alpha, &scene.mass), form(beta, &scene.stiffness)],
        None => {
            let parts = scene.energy_parts.as_ref();
            let linear = form(1.0, parts.map_or(&scene.damping, |parts| &parts.dissipative));
            let [_, taken] = scene.element_powers(q, u);
            [linear + taken, 0.0]
        }
    }
}

/// `a' matrix b`
pub(crate) fn bilinear(matrix: &SparseMatrix, a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .enumerate()
        .filter(|entry| *entry.1 != 0.0)
        .map(|(k, a)| a * matrix.row_dot(k, b))
        .sum()
}

/// The powers of one contact at an instant.
pub(crate) struct ContactPower {
    /// `T (t . u)`, and what bristles store, W.
    pub structure: f64,
    /// `T v`, W.
    pub slider: f64,
    /// `N |s|`, W.
    pub wear: f64,
}

/// The powers of all contacts in a state; `rest`: velocities where no slider carries them.
pub(crate) fn contact_powers<'a>(
    forces: &ContactForces,
    scene: &'a Scene,
    q: &[f64],
    u: &'a [f64],
    rest: &'a [f64],
) -> impl Iterator<Item = ContactPower> + use<'a> {
    let of_states: Vec<Option<InState>> = {
        let all = forces.combination.statuses().iter().enumerate();
        let closed = |(contact, status): (usize, &Status)| {
            status.is_closed().then(|| scene.of_state(contact, &forces.combination, q, u))?
        };
        all.map(closed).collect()
    };
    let forces = forces.values(scene, q, u).into_iter().zip(of_states);
    forces.zip(&scene.contacts).map(move |(((normal, friction), of_state), law)| {
        let stored = of_state.as_ref().map_or(0.0, |own| own.stored);
        let wear = of_state.and_then(|own| own.wear);
        ContactPower {
            structure: friction * rest[law.tangential] + stored,
            slider: friction * (law.slider_speed + slider_vibration(law, u, rest)),
            wear: wear.unwrap_or_else(|| match law.plane {
                None => normal * (u[law.tangential] - law.slider_speed).abs(),
                // N |w| by its parts along both directions.
                Some(plane) => {
                    let slip = u[law.tangential] - law.slider_speed;
                    let speed = slip.hypot(u[plane.tangential] - plane.slider_speed);
                    if speed == 0.0 { 0.0 } else { normal * slip * slip / speed }
                }
            }),
        }
    })
}

/// The speed that vibration adds to that of a slider.
pub(crate) fn slider_vibration(law: &Contact, u: &[f64], rest: &[f64]) -> f64 {
    rest[law.tangential] - u[law.tangential]
}

/// Energies and powers at `times`, in any order; at an event time just after it.
pub fn energy_at(trajectory: &Trajectory, times: &[f64]) -> Result<EnergySample, Error> {
    let moving = &**trajectory.scene();
    let scene = moving.bare();
    let groups = damper_groups(scene).len();
    let mut sample = EnergySample::default();
    let mut cursor = Cursor::new(trajectory);
    let mut known: Option<(ContactForces, EquationOfMotion)> = None;
    for &time in times {
        cursor.seek("times", time)?;
        let combination = &*trajectory.combination_of(cursor.phase);
        let (forces, equation) = match &mut known {
            Some(known) if known.0.combination == *combination => known,
            known => known.insert((
                ContactForces::new(moving, combination),
                EquationOfMotion::new(moving, combination)?,
            )),
        };
        let (moved, velocities) = (&cursor.q, &cursor.u);
        let (q, u) = moving.at_rest(moved, velocities);
        let (q, u) = (&q[..], &u[..]);
        let (kinetic, elastic) = energies(scene, q, u);
        sample.kinetic.push(kinetic);
        sample.elastic.push(elastic);

        let mut acceleration = vec![0.0; moving.size];
        let of_slip;
        let equation = match moving.is_nonlinear() {
            true => {
                of_slip = EquationOfMotion::new(
                    &moving.in_state(combination, moved, velocities),
                    combination,
                )?;
                &of_slip
            }
            false => &*equation,
        };
        let fitted = equation.scene(moving);
        let mut residual = fitted.residual(1.0, moved, velocities);
        equation.accelerate(&mut residual, &mut acceleration);
        fitted.dependents.follow_rates(&mut acceleration);
        let (_, acceleration) = moving.at_rest(velocities, &acceleration);
        let inertia =
            bilinear(&scene.mass, u, &acceleration) - moving.hidden_power(u, &acceleration);
        let [stored, _] = scene.element_powers(q, u);
        sample.rate.push(inertia + bilinear(elastic_stiffness(scene), u, q) + stored);

        let power = |force: &[f64]| force.iter().zip(u).map(|(f, u)| f * u).sum::<f64>();
        let mut force = scene.external_force();
        if let Some(drive) = &moving.drive {
            drive.add_forces(true, moved, force.to_mut());
            drive.add_forces(false, moved, force.to_mut());
        }
        sample.external.push(power(&force));
        sample.circulatory.push(circulatory_force(scene, q).map_or(0.0, |force| power(&force)));
        sample.damping.extend(&damping_powers(scene, q, u)[..groups]);
        for contact in contact_powers(forces, moving, moved, velocities, u) {
            sample.contact.push(contact.structure);
            sample.slider.push(contact.slider);
            sample.wear.push(contact.wear);
        }
        sample.combination.push(combination.clone());
    }
    Ok(sample)
}
