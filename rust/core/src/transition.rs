//! What the contacts do after an event: the one place where statuses change.

use crate::error::RunFailure;
use crate::event::Trigger;
use crate::scene::Scene;
use crate::status::Status;
use crate::trajectory::EventKind;

/// Which event function of a contact starts the next phase at zero, and with which multiplicity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Departure {
    #[default]
    None,
    /// The slip velocity: 2 after an onset of slip with mu_static = mu, else 1.
    Slip(usize),
    /// The gap: 1 after a bounce, 2 when a normal force was already negative, 3 after a release.
    Gap(usize),
}

/// Statuses and departures of all contacts, and what has happened to which.
#[derive(Debug)]
pub(crate) struct Settlement {
    pub statuses: Vec<Status>,
    pub departures: Vec<Departure>,
    /// By contact.
    pub events: Vec<(usize, EventKind)>,
}

/// Settles all contacts at an event in state (q, q'), which is brought to the exact zeros that the event
/// stands for: g = 0 at an impact, slip velocity zero at the end of a slide.
///
/// `triggers` are the event functions that vanish at this instant, by contact.
pub(crate) fn settle(
    scene: &Scene,
    time: f64,
    triggers: &[(usize, Trigger)],
    statuses: &[Status],
    q: &mut [f64],
    u: &mut [f64],
) -> Result<Settlement, RunFailure> {
    let mut impact = false;
    for &(contact, trigger) in triggers {
        let law = &scene.contacts[contact];
        match trigger {
            Trigger::SlipZero => u[law.tangential] = law.slider_speed,
            Trigger::GapClosed => {
                q[law.normal] = 0.0;
                impact = true;
                strike(scene, contact, u);
            }
            Trigger::Release | Trigger::SlipPositive | Trigger::SlipNegative => {}
        }
    }
    let mut settlement = Settlement {
        statuses: statuses.to_vec(),
        departures: vec![Departure::None; statuses.len()],
        events: Vec::with_capacity(1),
    };
    for contact in 0..statuses.len() {
        let trigger = of_contact(triggers, contact);
        if trigger.is_none() && !(impact && statuses[contact].is_closed()) {
            continue;
        }
        let before = statuses[contact];
        let (after, departure) = settle_contact(scene, time, contact, trigger, before, q, u)?;
        settlement.statuses[contact] = after;
        settlement.departures[contact] = departure;
        let kind = match trigger {
            Some(Trigger::GapClosed) => Some(EventKind::Impact),
            _ if after == before && trigger != Some(Trigger::SlipZero) => None,
            _ if after == Status::Detached => Some(EventKind::Release),
            Some(Trigger::SlipZero) => Some(EventKind::Velocity),
            _ if after == Status::Positive => Some(EventKind::SlipPositive),
            _ if after == Status::Negative => Some(EventKind::SlipNegative),
            _ => Some(EventKind::Velocity),
        };
        settlement.events.extend(kind.map(|kind| (contact, kind)));
    }
    Ok(settlement)
}

/// The trigger that decides for a contact: a vanishing normal force before a vanishing slip velocity;
/// both cone functions of a sticking contact vanish only with its normal force.
fn of_contact(triggers: &[(usize, Trigger)], contact: usize) -> Option<Trigger> {
    let mut own = triggers
        .iter()
        .filter(|trigger| trigger.0 == contact)
        .map(|trigger| trigger.1);
    let first = own.next()?;
    match (first, own.next()) {
        (first, None) => Some(first),
        _ => Some(Trigger::Release),
    }
}

/// `g'+ = -e g'-`, and with `impact_friction` the Coulomb impulse of at most `mu p_n` that drives slip
/// towards zero; mass does not couple contact coordinates.
fn strike(scene: &Scene, contact: usize, u: &mut [f64]) {
    let law = &scene.contacts[contact];
    let approach = u[law.normal];
    u[law.normal] = -law.restitution * approach;
    if scene.impact_friction {
        let normal_mass = scene.mass.get(law.normal, law.normal);
        let tangential_mass = scene.mass.get(law.tangential, law.tangential);
        let limit = law.friction * (1.0 + law.restitution) * normal_mass * approach.abs();
        let slip = u[law.tangential] - law.slider_speed;
        if tangential_mass * slip.abs() <= limit {
            u[law.tangential] = law.slider_speed;
        } else {
            u[law.tangential] -= slip.signum() * limit / tangential_mass;
        }
    }
}

fn settle_contact(
    scene: &Scene,
    time: f64,
    contact: usize,
    trigger: Option<Trigger>,
    before: Status,
    q: &[f64],
    u: &[f64],
) -> Result<(Status, Departure), RunFailure> {
    let law = &scene.contacts[contact];
    match trigger {
        Some(Trigger::Release) => return Ok((Status::Detached, Departure::Gap(3))),
        Some(Trigger::SlipPositive | Trigger::SlipNegative) => {
            let multiplicity = if law.static_friction > law.friction {
                1
            } else {
                2
            };
            let status = if trigger == Some(Trigger::SlipPositive) {
                Status::Positive
            } else {
                Status::Negative
            };
            return Ok((status, Departure::Slip(multiplicity)));
        }
        Some(Trigger::GapClosed) if u[law.normal] > 0.0 => {
            return Ok((Status::Detached, Departure::Gap(1)));
        }
        _ => {}
    }
    let normal_force = scene.reaction(law.normal).value(q, u);
    if normal_force < 0.0 {
        return Ok((Status::Detached, Departure::Gap(2)));
    }
    let slip = u[law.tangential] - law.slider_speed;
    if slip != 0.0 || law.static_friction == 0.0 {
        let status = match slip {
            slip if slip < 0.0 => Status::Positive,
            slip if slip > 0.0 => Status::Negative,
            _ if before.is_sliding() => before,
            _ => Status::Positive,
        };
        return Ok((status, Departure::None));
    }
    let required_friction = scene.reaction(law.tangential).value(q, u);
    let limit = law.static_friction * normal_force;
    if required_friction.abs() <= limit {
        Ok((Status::Sticking, Departure::None))
    } else if required_friction > limit {
        Ok((Status::Positive, Departure::Slip(1)))
    } else if required_friction < -limit {
        Ok((Status::Negative, Departure::Slip(1)))
    } else {
        Err(RunFailure::NoConsistentStatus {
            contact,
            time,
            normal_force,
            required_friction,
        })
    }
}
