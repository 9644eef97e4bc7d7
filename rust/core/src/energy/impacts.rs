//! The energies that impacts, and the limits of bounces, take from a motion.

use crate::contact::event_kind::EventKind;
use crate::energy::power::slider_vibration;
use crate::linalg::dense::impulses_of;
use crate::scene::model::Scene;
use crate::transient::trajectory::model::Trajectory;

/// The energy that one contact takes from the motion at an impact or at the limit of its bounces, J.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImpactWork {
    /// Time of the impact, s.
    pub time: f64,
    /// Index of the contact.
    pub contact: usize,
    /// Energy lost in the normal direction.
    pub normal: f64,
    /// Work of the slider through the tangential impulse.
    pub slider: f64,
    /// Friction heat of the tangential impulse.
    pub friction: f64,
}

/// Adds the energies that the contacts take at the start of `phase`, where (q, q') is the state at the end of the phase
/// before.
pub(crate) fn add_impacts(
    trajectory: &Trajectory,
    phase: usize,
    (q, u): (&[f64], &[f64]),
    impacts: &mut Vec<ImpactWork>,
) {
    let moving = &**trajectory.scene();
    let scene = moving.bare();
    let coupled = scene.contacts_coupled();
    let (mut impact, mut jump_of_places) = (false, false);
    for event in trajectory.events_at(phase) {
        match event.kind {
            EventKind::Impact => impact = true,
            EventKind::Jump | EventKind::Load => (impact, jump_of_places) = (true, true),
            // If mass couples contacts, an impulse on one changes the others: the jump of the velocities gives its energy.
            EventKind::Accumulation if coupled => impact = true,
            EventKind::Accumulation => {
                let (contact, before) = (event.contact, trajectory.phase_state(phase - 1));
                let law = &scene.contacts[contact];
                let row = law.normal;
                let (gap, speed) = (law.gap_at(before.parts().0), before.parts().1[row]);
                let load = moving.stiffness.row_dot(row, q) - moving.force[row];
                let normal = 0.5 * normal_mass(scene, contact) * speed * speed + load * gap;
                let time = event.time;
                impacts.push(ImpactWork { time, contact, normal, slider: 0.0, friction: 0.0 });
            }
            _ => {}
        }
    }
    add_jumps_of_springs(trajectory, phase, u, impacts);
    if !impact || jump_of_places && scene.massless.is_empty() {
        return;
    }
    let time = trajectory.phases[phase].start;
    let state = trajectory.phase_state(phase);
    let (position, after) = state.parts();
    let rest = moving.at_rest(q, u).1;
    let jump: Vec<f64> = after.iter().zip(u).map(|(b, a)| b - a).collect();
    let impulses = impulses(trajectory, phase, &jump);
    for (contact, law) in scene.contacts.iter().enumerate() {
        let [p_t, p_n] = [impulses[2 * contact], impulses[2 * contact + 1]];
        let mean = |row: usize| 0.5 * (after[row] + u[row]);
        let moved = [law.tangential, law.normal].iter().any(|&row| position[row] != q[row]);
        let jumped = jump_of_places && !law.normal_has_mass() && moved;
        let reset = |row: usize| {
            if !coupled && !jumped {
                return 0.0;
            }
            let middle: Vec<f64> = q.iter().zip(position).map(|(a, b)| 0.5 * (a + b)).collect();
            let force = moving.force[row] - moving.stiffness.row_dot(row, &middle);
            force * (position[row] - q[row])
        };
        // Both directions of a plane strike at once, and the normal impulse counts with the first.
        let shares = law.shares_normal();
        let striking = law.plane.filter(|_| shares).map_or(contact, |plane| plane.beside);
        let struck = trajectory
            .events_at(phase)
            .any(|event| event.contact == striking && event.kind == EventKind::Impact);
        // Where mass couples contacts, every closed one may take an impulse.
        if !(struck || jumped || coupled && (p_n, p_t) != (0.0, 0.0)) {
            continue;
        }
        let slid = if jumped && !law.tangential_has_mass() { reset(law.tangential) } else { 0.0 };
        impacts.push(ImpactWork {
            time,
            contact,
            normal: if shares { 0.0 } else { -p_n * mean(law.normal) + reset(law.normal) },
            slider: p_t * (law.slider_speed + slider_vibration(law, u, &rest)),
            friction: -p_t * (mean(law.tangential) - law.slider_speed) + slid,
        });
    }
}

/// Adds what springs of contacts in planes lose as their nodes move at once: where the normal force jumps, and with it the limit of
/// their forces.
fn add_jumps_of_springs(
    trajectory: &Trajectory,
    phase: usize,
    u: &[f64],
    impacts: &mut Vec<ImpactWork>,
) {
    let springs = trajectory.scene().state_contacts();
    let springs = springs.filter(|(_, own)| own.law.is_spring() && own.normal.is_some());
    let springs: Vec<_> = springs.collect();
    if springs.is_empty() {
        return;
    }
    let time = trajectory.phases[phase].start;
    let state = trajectory.phase_state(phase);
    let (_, after) = state.parts();
    for (contact, own) in springs {
        let [before, after] = [u[own.coordinate], after[own.coordinate]];
        let friction = 0.5 * own.mass * (before + after) * (before - after);
        if friction != 0.0 {
            impacts.push(ImpactWork {
                time,
                contact: *contact,
                normal: 0.0,
                slider: 0.0,
                friction,
            });
        }
    }
}

/// The impulses `M (u+ - u-)` of the contacts, (tangential, normal) of each, kg m/s.
fn impulses(trajectory: &Trajectory, phase: usize, jump: &[f64]) -> Vec<f64> {
    let moving = trajectory.scene();
    let scene = moving.bare();
    let rows = scene.contacts.iter().flat_map(|law| [law.tangential, law.normal]);
    let dependent = scene.coordinates.delassus.as_ref().filter(|_| !scene.dependents.is_empty());
    let Some(w) = dependent else {
        return rows.map(|row| moving.mass.row_dot(row, jump)).collect();
    };
    let before = trajectory.combination_of(phase - 1);
    let statuses = before.statuses();
    let struck = |i: usize| trajectory.events_at(phase).any(|event| event.contact == i);
    let touches = |row: &usize| statuses[row / 2].is_closed() || struck(row / 2);
    let touching: Vec<usize> = (0..w.nrows()).filter(touches).collect();
    impulses_of(w, &touching, &rows.map(|row| jump[row]).collect::<Vec<f64>>())
}

/// `1 / (n' M^-1 n)`: the mass that an impact of this contact alone moves.
fn normal_mass(scene: &Scene, contact: usize) -> f64 {
    let size = 2 * scene.contacts.len();
    let normal = 2 * contact + 1;
    match &scene.coordinates.delassus {
        Some(w) => 1.0 / w[normal * size + normal],
        None => scene.mass.get(scene.contacts[contact].normal, scene.contacts[contact].normal),
    }
}
