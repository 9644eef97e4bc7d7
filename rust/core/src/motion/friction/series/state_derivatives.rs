//! Derivatives of the friction of a contact with a state, along lines through steady slip.

use crate::motion::friction::series::law_series::LawSeries;
use crate::scene::friction::bristles::Hysteresis;
use crate::scene::friction::contact_state::{ContactState, StateContact};
use crate::scene::friction::law::FrictionLaw;
use crate::scene::model::Scene;
use crate::scene::status::Status;

/// Distance of a steady state from where two pieces meet, relative to it, that is rounding.
const AT_KNOT: f64 = 1e-9;

/// Taylor coefficients up to the third order.
type Cubic = [f64; 4];

fn product(a: &Cubic, b: &Cubic) -> Cubic {
    std::array::from_fn(|k| (0..=k).map(|i| a[i] * b[k - i]).sum())
}

/// Of a contact with a state, in steady sliding: the friction force per normal force against slip and the rate of the state, each
/// with its derivatives by `s, z, ss, sz, zz, sss, ssz, szz, zzz` over slip velocity and state. None where there are none: without a
/// state or a speed of the slider, and of elasto-plastic bristles, whose steady slip lies where two pieces meet.
pub fn state_derivatives(scene: &Scene, contact: usize) -> Option<[[f64; 10]; 2]> {
    let (own, law) = (scene.state_of(contact)?, scene.friction_law(contact)?);
    let slip = -scene.contacts[contact].slider_speed;
    let state = own.law.steady(slip);
    if !(slip != 0.0 && state != 0.0 && state.is_finite()) {
        return None;
    }
    // Steps as large as what they are taken from: mixed derivatives are differences of those along lines.
    let along = |ds: f64, dz: f64| along(own, law, [slip, slip * ds], [state, state * dz]);
    let lines = [along(1.0, 0.0)?, along(0.0, 1.0)?, along(1.0, 1.0)?, along(1.0, -1.0)?];
    Some([0, 1].map(|of| {
        let [slips, states, both, apart] = lines.map(|line| line[of]);
        let (even, odd) = (0.5 * (both[3] + apart[3]), 0.5 * (both[3] - apart[3]));
        let mixed = 0.5 * (both[2] - apart[2]);
        let [s, z] = [slip, state];
        [
            slips[0],
            slips[1] / s,
            states[1] / z,
            2.0 * slips[2] / (s * s),
            mixed / (s * z),
            2.0 * states[2] / (z * z),
            6.0 * slips[3] / (s * s * s),
            2.0 * (odd - states[3]) / (s * s * z),
            2.0 * (even - slips[3]) / (s * z * z),
            6.0 * states[3] / (z * z * z),
        ]
    }))
}

/// The coefficients of force and rate along a line of slip velocity and state.
fn along(own: &StateContact, law: &FrictionLaw, s: [f64; 2], z: [f64; 2]) -> Option<[Cubic; 2]> {
    let sign = 1.0_f64.copysign(s[0]);
    let line = |of: [f64; 2]| -> Cubic { [of[0], of[1], 0.0, 0.0] };
    let (slip, speed, state) = (line(s), line(s.map(|s| sign * s)), line(z));
    let status = if sign > 0.0 { Status::Negative } else { Status::Positive };
    let numbers = match &own.law {
        ContactState::Bristles(numbers) => numbers,
        ContactState::Formulas(formulas) => {
            let of = formulas.in_status(status);
            if of.knots.iter().any(|knot| (state[0] - knot).abs() <= AT_KNOT * state[0].abs()) {
                return None;
            }
            return Some(of.at(state[0]).each_ref().map(|formula| {
                let (law, mut series) =
                    (FrictionLaw::Formula(formula.clone()), LawSeries::default());
                std::array::from_fn(|k| series.extend(&law, k, [speed[k], state[k]], 0.0).0)
            }));
        }
    };
    let series = |law: &FrictionLaw, argument: &Cubic| -> Cubic {
        let (LawSeries { excess, .. }, _) = LawSeries::along(law, argument);
        std::array::from_fn(|k| excess[k] + if k == 0 { law.value(0.0) } else { 0.0 })
    };
    let lost = match numbers.hysteresis {
        None => product(&series(law, &speed), &state),
        Some(Hysteresis::ElastoPlastic { .. } | Hysteresis::Plane) => return None,
        Some(shape) => product(&series(&numbers.loop_in(status, shape), &state), &speed),
    };
    let rate: Cubic = std::array::from_fn(|k| slip[k] - lost[k]);
    let force = |k: usize| {
        numbers.stiffness * state[k] + numbers.damping * rate[k] + numbers.viscous * slip[k]
    };
    Some([std::array::from_fn(force), rate])
}
