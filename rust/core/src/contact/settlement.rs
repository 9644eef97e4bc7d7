//! The result of an event: statuses, departures, and the events of contacts.

use crate::contact::event_function::EventFunction;
use crate::contact::event_kind::EventKind;
use crate::scene::model::Scene;
use crate::scene::status::Status;

/// Which event function of a contact starts the next phase at zero, and with which multiplicity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Departure {
    #[default]
    None,
    /// The slip velocity: 2 after an onset of slip with mu_static = mu, else 1.
    Slip(u8),
    /// The gap: 1 after a bounce or a release without mass, 2 when a normal force was already negative, 3 after a release.
    Gap(u8),
    /// How many derivatives of N, and of `mu_static N +- T` of a sticking contact, vanish at the start of the phase: 1 after the
    /// gap of a massless contact has closed.
    Force(u8),
    /// The bound in one direction of what sticks without mass: 2 after slip has come to an end, 1 when another contact
    /// has ended it.
    Bound(Status, u8),
    /// Slip velocity and normal force at once, each 1.
    SlipAndForce,
}

impl Departure {
    /// Multiplicity of the zero at which an event function of the contact begins.
    pub fn multiplicity(self, trigger: EventKind) -> usize {
        use EventKind::{Closing, Impact, Release, SlipNegative, SlipPositive, Velocity};
        match (self, trigger) {
            (Self::Slip(multiplicity), Velocity)
            | (Self::Gap(multiplicity), Impact | Closing)
            | (Self::Force(multiplicity), Release | SlipPositive | SlipNegative)
            | (Self::Bound(Status::Positive, multiplicity), SlipPositive)
            | (Self::Bound(Status::Negative, multiplicity), SlipNegative)
            | (Self::Bound(Status::Slipping, multiplicity), EventKind::Slip) => multiplicity.into(),
            // The squares of both forces.
            (Self::Force(multiplicity), EventKind::Slip) => 2 * usize::from(multiplicity),
            (Self::SlipAndForce, Velocity | Release) => 1,
            _ => 0,
        }
    }
}

/// Rounding of the slip velocity of a coordinate without mass and of its force, which are sums of few terms, relative to
/// their size.
pub(crate) const NODE_ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Statuses and departures of all contacts, and the contacts and kinds of the last event.
#[derive(Debug)]
pub(crate) struct Settlement {
    pub statuses: Vec<Status>,
    pub departures: Vec<Departure>,
    /// By contact.
    pub events: Vec<(usize, EventKind)>,
    /// Duration of the part of a series that a joint closing of several contacts leaves out, s.
    pub rest: Option<f64>,
}

/// What earlier events say about the one that is settled, and the limits that decide whether a series of impacts over several
/// contacts ends.
#[derive(Debug, Default)]
pub(crate) struct Series {
    /// Contacts that have struck at the same time already.
    pub struck: Vec<usize>,
    /// Bound of the error of the gap of each contact, m.
    pub gaps: Vec<f64>,
    /// Gap below which a series is not followed, m.
    pub resolution: f64,
    /// Ratio of successive intervals between impacts of each contact; 0 if there are too few impacts before.
    pub ratios: Vec<f64>,
    /// The rest that may be left out, s.
    pub negligible: f64,
    /// The resolution of the clock, s.
    pub ulp: f64,
}

impl Settlement {
    /// A contact whose gap is zero and opens departs from zero, whatever the event was. A gap that is a sum of other
    /// coordinates may be negative by their rounding.
    pub fn depart(
        &mut self,
        scene: &Scene,
        among: impl Iterator<Item = usize>,
        q: &[f64],
        u: &[f64],
    ) {
        for contact in among {
            let law = &scene.contacts[contact];
            let departure = &mut self.departures[contact];
            if *departure == Departure::None
                && self.statuses[contact] == Status::Detached
                && law.normal_has_mass()
                && law.gap_at(q) <= 0.0
                && u[law.normal] > 0.0
            {
                *departure = Departure::Gap(1);
            }
        }
    }

    /// A node without mass that goes on sliding while its slip velocity is zero, since an impact has just stopped the slip of
    /// its body, departs from zero. `functions` are those of the phase that begins; in them the velocity of the node is the
    /// sum of the velocities that it follows.
    pub fn depart_with_bodies(
        &mut self,
        scene: &Scene,
        functions: &[EventFunction],
        q: &[f64],
        u: &[f64],
    ) {
        let of_nodes = |function: &&EventFunction| {
            function.trigger == EventKind::Velocity
                && !scene.contacts[function.contact].tangential_has_mass()
                && !scene.creeps(function.contact)
        };
        for EventFunction { contact, functional, .. } in functions.iter().filter(of_nodes) {
            let rounding = NODE_ROUNDING * functional.magnitude(q, u);
            if self.departures[*contact] == Departure::None
                && functional.value(q, u).abs() <= rounding
            {
                self.departures[*contact] = Departure::Slip(1);
            }
        }
    }

    pub fn record(
        &mut self,
        contact: usize,
        trigger: Option<EventKind>,
        after: Status,
        departure: Departure,
    ) {
        let before = self.statuses[contact];
        self.statuses[contact] = after;
        self.departures[contact] = departure;
        let kind = match trigger {
            Some(EventKind::Impact) => EventKind::Impact,
            Some(EventKind::Accumulation) => EventKind::Accumulation,
            Some(EventKind::Closing) => EventKind::Closing,
            Some(EventKind::Jump) => EventKind::Jump,
            _ if after == before && trigger != Some(EventKind::Velocity) => return,
            _ if after == Status::Detached => EventKind::Release,
            Some(EventKind::Velocity) => EventKind::Velocity,
            _ if before == Status::Sticking && after == Status::Positive => EventKind::SlipPositive,
            _ if before == Status::Sticking && after == Status::Negative => EventKind::SlipNegative,
            _ if after == Status::Slipping && before != Status::Detached => EventKind::Slip,
            // A tangential impulse that stopped or reversed a slip.
            _ => EventKind::Velocity,
        };
        self.events.push((contact, kind));
    }
}

/// The trigger that decides for a contact: a vanishing normal force before a vanishing slip velocity;
/// both cone functions of a sticking contact vanish only with its normal force.
pub(crate) fn of_contact(triggers: &[(usize, EventKind)], contact: usize) -> Option<EventKind> {
    let mut own = triggers.iter().filter(|trigger| trigger.0 == contact).map(|trigger| trigger.1);
    let first = own.next()?;
    Some(if own.next().is_some() { EventKind::Release } else { first })
}

/// The status and departure of an event that changes no velocity and, with mu_static = mu, no force.
pub(crate) fn continuous(
    scene: &Scene,
    contact: usize,
    trigger: EventKind,
    before: Status,
) -> Option<(Status, Departure)> {
    let law = &scene.contacts[contact];
    let onset = if law.static_friction > law.friction { 1 } else { 2 };
    match trigger {
        EventKind::Release => Some((Status::Detached, Departure::Gap(3))),
        EventKind::SlipPositive => Some((Status::Positive, Departure::Slip(onset))),
        EventKind::SlipNegative => Some((Status::Negative, Departure::Slip(onset))),
        // Friction vanishes with slip, and only its sign changes.
        EventKind::Velocity if scene.reverses(contact) => {
            Some((before.reversed(), Departure::Slip(1)))
        }
        _ => None,
    }
}

/// The sign of a slip velocity as a status; `None` at zero.
pub(crate) fn sliding_status(slip: f64) -> Option<Status> {
    match slip {
        slip if slip < 0.0 => Some(Status::Positive),
        slip if slip > 0.0 => Some(Status::Negative),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::SparseMatrix;
    use crate::motion::combination_basis::CombinationBasis;
    use crate::motion::method::Wanted;
    use crate::scene::status::Combination;
    use crate::scene::{ContactInput, Damping, Direction, Mass, SceneInput, Springs};

    /// A node on three dofs whose velocities cancel but for rounding, on a slider at rest.
    #[test]
    fn a_node_departs_whose_velocity_is_the_rounding_of_those_it_follows() {
        let node = ContactInput {
            tangential: Some(Direction::Entries(vec![(0, 0.1), (1, 0.2), (2, -0.3)])),
            normal: None,
            normal_force: 2.0,
            friction: 0.5,
            static_friction: 0.5,
            slider_speed: 0.0,
            springs: Springs { tangential: Some(1e4), normal: None },
            ..Default::default()
        };
        let input = SceneInput {
            mass: Mass::Lumped(vec![1.0; 3]),
            stiffness: SparseMatrix::diagonal(&[1e4; 3]),
            damping: Damping::Proportional { mass: 0.0, stiffness: 1e-5 },
            force: vec![0.0; 3],
            contacts: vec![node],
            ..Default::default()
        };
        let scene = Scene::new(input).expect("well-posed");
        let combination = Combination::new(vec![Status::Positive]);
        let basis = CombinationBasis::new(&scene, &combination, Wanted::Series).expect("sliding");
        let functional = &basis.functions[0].functional;
        let departed = |last: f64| {
            let (mut q, mut u) = (vec![0.0; scene.mass.size()], vec![0.0; scene.mass.size()]);
            for &(k, weight) in &functional.velocity {
                u[k] = if weight.abs() > 0.25 { last } else { 1.0 };
            }
            basis.complete(&mut q, &mut u);
            let mut settlement = Settlement {
                statuses: combination.statuses().to_vec(),
                departures: vec![Departure::None],
                events: Vec::new(),
                rest: None,
            };
            settlement.depart_with_bodies(&scene, &basis.functions, &q, &u);
            (u[scene.contacts[0].tangential], settlement.departures[0])
        };
        let (slip, departure) = departed(1.0);
        assert!(slip != 0.0 && slip.abs() < 1e-15, "{slip:e}");
        assert_eq!(departure, Departure::Slip(1));
        assert_eq!(departed(1.0 + 1e-13).1, Departure::None);
    }
}
