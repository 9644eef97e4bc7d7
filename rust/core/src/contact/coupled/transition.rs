//! The transitions of contacts that mass couples: an impulse or a force on one of them moves all.

use crate::contact::coupled::contacts::{Coupled, Touching};
use crate::contact::coupled::joint_closing::close_jointly;
use crate::contact::event_kind::EventKind;
use crate::contact::settlement::{
    Departure, Series, Settlement, continuous, of_contact, sliding_status,
};
use crate::error::run::RunFailure;
use crate::scene::status::Status;

/// Settles all contacts at the event of `triggers`; see [`crate::contact::transition::settle`].
pub(crate) fn settle_coupled(
    coupled: &Coupled<'_>,
    triggers: &[(usize, EventKind)],
    settlement: &mut Settlement,
    series: &Series,
    q: &mut [f64],
    u: &mut [f64],
) -> Result<(), RunFailure> {
    let contacts = &coupled.scene.contacts;
    let statuses = settlement.statuses.clone();
    let mut joint = None;
    let mut struck: Vec<usize> = triggers
        .iter()
        .filter(|trigger| trigger.1 == EventKind::Impact)
        .map(|trigger| trigger.0)
        .collect();
    if !struck.is_empty() {
        coupled.strike_in_turn(&statuses, &series.gaps, &mut struck, q, u)?;
        let closed: Vec<usize> = (0..contacts.len())
            .filter(|&i| statuses[i].is_closed() || struck.contains(&i))
            .collect();
        let whole = |i: &usize| settlement.departures[*i] == Departure::Gap(1);
        let broken = struck.len() == 1 && !struck.iter().all(whole);
        joint = close_jointly(coupled, &struck, &closed, broken, series, q, u)?;
    }
    settlement.departures.fill(Departure::None);
    let joins = |i: usize| joint.as_ref().is_some_and(|joint| joint.contacts.contains(&i));
    let mut outcome: Vec<(Status, Departure)> =
        statuses.iter().map(|&status| (status, Departure::None)).collect();
    let mut forces_jump = triggers.iter().any(|trigger| trigger.1 == EventKind::Load);
    let mut problem: Vec<Touching> = Vec::new();
    for (i, law) in contacts.iter().enumerate() {
        let trigger = of_contact(triggers, i);
        let settled =
            trigger.and_then(|trigger| continuous(coupled.scene, i, trigger, statuses[i]));
        if let Some(settled) = settled {
            outcome[i] = settled;
            forces_jump |= settled.0.is_sliding() && law.static_friction > law.friction;
        }
        let arrived = trigger == Some(EventKind::Accumulation) || struck.contains(&i) || joins(i);
        let ends_sliding = trigger == Some(EventKind::Velocity) && settled.is_none();
        forces_jump |= ends_sliding || arrived;
        let touching = statuses[i].is_closed() || arrived;
        if touching && u[law.normal] > 0.0 {
            outcome[i] = (Status::Detached, Departure::Gap(1));
        } else if touching && outcome[i].0.is_closed() || arrived {
            let ends = trigger == Some(EventKind::Velocity);
            let sliding = match settled {
                Some((status, _)) => Some(status),
                // Zero, though as a sum of other velocities it is rounded.
                None if struck.is_empty() && (ends || statuses[i] == Status::Sticking) => None,
                None => sliding_status(u[law.tangential] - law.slider_speed),
            };
            problem.push((i, sliding));
        }
    }
    if forces_jump && !problem.is_empty() {
        let solution = coupled.accelerate(&problem, q, u)?;
        let is_pushed = |i: usize, departure: Departure| {
            departure == Departure::Slip(2)
                && coupled.slip_rate(i, &problem, &solution, q, u) != 0.0
        };
        for (&(i, sliding), &status) in problem.iter().zip(&solution.statuses) {
            outcome[i] = match status {
                Status::Detached => (status, Departure::Gap(2)),
                Status::Sticking => (status, Departure::None),
                // A contact that slips goes on; the onset of slip keeps its multiplicity unless a jump of the forces pushes
                // the contact.
                _ if sliding.is_some() && !is_pushed(i, outcome[i].1) => (status, outcome[i].1),
                _ if coupled.scene.reverses(i) => {
                    let rate = coupled.slip_rate(i, &problem, &solution, q, u);
                    (sliding_status(rate).unwrap_or(status), Departure::Slip(1))
                }
                _ => (status, Departure::Slip(1)),
            };
        }
    }
    for (contact, &(after, departure)) in outcome.iter().enumerate() {
        let trigger = match of_contact(triggers, contact) {
            _ if joins(contact) => Some(EventKind::Accumulation),
            _ if struck.contains(&contact) => Some(EventKind::Impact),
            trigger => trigger,
        };
        settlement.record(contact, trigger, after, departure);
    }
    settlement.rest = joint.map(|joint| joint.rest);
    Ok(())
}
