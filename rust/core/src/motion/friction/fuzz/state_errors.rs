//! True errors of panels with contacts that have states, by the equations in displacements and states in doubled precision.
//!
//! The reference has z as a state of first order, and nothing of the hidden coordinate by which the series carry it.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::DMatrix;
use proptest::prelude::*;

use crate::linalg::sparse::SparseMatrix;
use crate::motion::combination_basis::{CombinationBasis, Propagator};
use crate::motion::friction::fuzz::true_errors::{
    STEPS, TERMS, argument_of, element, extend, slots,
};
use crate::motion::friction::motion::LawMotion;
use crate::motion::friction::series::law_contact::LawOf;
use crate::motion::method::Wanted;
use crate::motion::panel::Panel;
use crate::numerics::double_double::Doubled;
use crate::scene::contact_law::{ContactInput, Direction};
use crate::scene::friction::bristles::{Bristles, Hysteresis};
use crate::scene::friction::contact_state::{ContactState, StateContact, StateFormulas};
use crate::scene::friction::formula::GivenOperation;
use crate::scene::friction::law::FrictionLaw;
use crate::scene::input::scene_input::{Damping, Mass, SceneInput};
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};

/// Panels of one motion.
const PANELS: usize = 8;
/// Times that bristles relax in one step of the reference, at most.
const RELAXES: f64 = 2.5;
/// Units of rounding of a polynomial and of a sum of a few terms.
const ROUNDING: f64 = 8.0;
/// Part of the largest deflection up to which one counts as zero.
const SIDE: f64 = 1e-12;
/// Slider speed, m/s; contacts slide in the positive direction.
const SPEED: f64 = 0.5;

/// Displacements, velocities and states.
type State = [Vec<Doubled>; 3];

fn zero() -> Doubled {
    Doubled::default()
}

/// The coefficients of `sigma_0 |s| / g(|s|)` up to the order of the last one of |s|.
fn of_law(law: &FrictionLaw, slip: &[Doubled], inner: &mut Vec<Doubled>) -> Doubled {
    match law {
        FrictionLaw::Linear { slope, .. } => slip[slip.len() - 1].times(*slope),
        FrictionLaw::Formula(formula) => {
            slots(formula.operations(), slip, &[], inner);
            inner[inner.len() - 1]
        }
        _ => panic!("no law of bristles"),
    }
}

/// `f(z) |s|` of a loop, of order k, where s < 0; z has a sign, which a panel does not change.
fn of_loop(numbers: &Bristles, [exponent, share]: [f64; 2], [z, slip]: [&[Doubled]; 2]) -> Doubled {
    // Slip takes z down from 0.
    let side = if z[0].value() > SIDE * numbers.kinetic / numbers.stiffness { 1.0 } else { -1.0 };
    let convolved = |a: &[Doubled], b: &[Doubled], k: usize| {
        (0..=k).fold(zero(), |sum, j| sum.add(a[j].by(b[k - j])))
    };
    let bent = |z: &Doubled| z.times(side * numbers.stiffness).over(numbers.kinetic.into());
    let bent: Vec<Doubled> = z.iter().map(bent).collect();
    let mut power = bent.clone();
    for _ in 1..exponent as usize {
        power = (0..z.len()).map(|k| convolved(&power, &bent, k)).collect();
    }
    let turned = Doubled::from(side * share).add(share.into()).add((-1.0).into());
    convolved(&power, slip, z.len() - 1).by(turned)
}

/// The state a time `width` later: `m x'' = F - K x - C x' + T`, `z' = s - y`, where s < 0.
fn moved(scene: &Scene, input: &SceneInput, state: &mut State, width: f64) {
    let size = input.force.len();
    let [mass, damping, stiffness, ..] = input.matrices();
    let rates = input.contacts.iter().map(|contact| match (&contact.tangential, &contact.state) {
        (Some(Direction::Dof(t)), Some(ContactState::Bristles(numbers))) => {
            let speed = state[1][*t].value().abs() + SPEED;
            speed * numbers.stiffness / numbers.kinetic.min(numbers.at_rest)
        }
        _ => 0.0,
    });
    let steps = (width * rates.fold(0.0, f64::max) / RELAXES).ceil().max(STEPS as f64);
    for _ in 0..steps as usize {
        let [mut x, mut v, mut z] = state.each_ref().map(|part| vec![part.clone()]);
        let count = input.contacts.len();
        let (mut slips, mut inner, mut laws) =
            (vec![Vec::new(); count], vec![Vec::new(); count], vec![Vec::<Doubled>::new(); count]);
        let mut of_formulas = [vec![Vec::new(); count], vec![Vec::new(); count]];
        let mut of_elements = vec![[const { Vec::<Doubled>::new() }; 3]; scene.elements().len()];
        for k in 0..TERMS {
            let order = Doubled::from((k + 1) as f64);
            let row = |i: usize| {
                let load = Doubled::from(if k == 0 { input.force[i] } else { 0.0 });
                let springs = stiffness.row(i).map(|(j, value)| x[k][j].times(-value));
                let dampers = damping.row(i).map(|(j, value)| v[k][j].times(-value));
                springs.chain(dampers).fold(load, Doubled::add)
            };
            let mut loads: Vec<Doubled> = (0..size).map(row).collect();
            for (one, [argument, inner, force]) in scene.elements().iter().zip(&mut of_elements) {
                argument.push(argument_of(one, [&x[k], &v[k]], k == 0));
                extend(&one.excess, 0, argument, inner, force);
                let [at_rest, slope] = one.linear;
                let line = Doubled::from(if k == 0 { at_rest } else { 0.0 });
                let whole = force[k].add(line).add(argument[k].times(slope));
                for &(row, weight) in &one.direction {
                    loads[row] = loads[row].add(whole.times(-weight));
                }
            }
            let mut rates = vec![zero(); count];
            for (i, contact) in input.contacts.iter().enumerate() {
                let (Some(Direction::Dof(t)), Some(law)) = (&contact.tangential, &contact.state)
                else {
                    panic!("a state along a dof");
                };
                let slip = v[k][*t].add(Doubled::from(if k == 0 { -SPEED } else { 0.0 }));
                slips[i].push(slip.times(-1.0));
                let numbers = match law {
                    ContactState::Bristles(numbers) => numbers,
                    ContactState::Formulas(formulas) => {
                        let own: Vec<Doubled> = z.iter().map(|z| z[i]).collect();
                        let of = formulas.in_status(Status::Positive);
                        // Slip takes z down from a border of two pieces.
                        let beside = SIDE * of.knots.first().map_or(0.0, |knot| knot.abs());
                        let both = of.at(own[0].value() - beside);
                        let [force, rate] = [0, 1].map(|place| {
                            let inner = &mut of_formulas[place][i];
                            slots(both[place].operations(), &slips[i], &own, inner);
                            inner[inner.len() - 1]
                        });
                        rates[i] = rate;
                        loads[*t] = loads[*t].add(force.times(-contact.normal_force));
                        continue;
                    }
                };
                let product = match numbers.hysteresis {
                    Some(Hysteresis::BoucWen { exponent, share }) => {
                        let own: Vec<Doubled> = z.iter().map(|z| z[i]).collect();
                        of_loop(numbers, [exponent as f64, share], [&own, &slips[i]])
                    }
                    Some(Hysteresis::ElastoPlastic { .. } | Hysteresis::Plane) => {
                        panic!("no such loop is drawn")
                    }
                    None => {
                        let law = scene.friction_law(i).expect("a law");
                        laws[i].push(of_law(law, &slips[i], &mut inner[i]));
                        (0..=k).fold(zero(), |sum, j| sum.add(laws[i][j].by(z[k - j][i])))
                    }
                };
                rates[i] = slip.add(product.times(-1.0));
                let force = z[k][i].times(numbers.stiffness);
                let force = force.add(rates[i].times(numbers.damping));
                let force = force.add(slip.times(numbers.viscous));
                loads[*t] = loads[*t].add(force.times(-contact.normal_force));
            }
            let accelerated =
                |(i, load): (usize, &Doubled)| load.over(mass.get(i, i).into()).over(order);
            x.push(v[k].iter().map(|v| v.over(order)).collect());
            v.push(loads.iter().enumerate().map(accelerated).collect());
            z.push(rates.iter().map(|rate| rate.over(order)).collect());
        }
        let step = width / steps;
        for (sum, terms) in state.iter_mut().zip([&x, &v, &z]) {
            for (j, sum) in sum.iter_mut().enumerate() {
                let horner = |value: Doubled, term: &Vec<Doubled>| value.times(step).add(term[j]);
                *sum = terms.iter().rev().fold(zero(), horner);
            }
        }
    }
}

/// A row of masses on springs under small loads, without contacts.
pub(super) fn structure(size: usize, numbers: &[f64], general: bool) -> SceneInput {
    let number = |place: usize| numbers[place % numbers.len()];
    let entry = |i: usize, j: usize| match i.abs_diff(j) {
        0 => 100.0 * (1.5 + number(i)),
        1 => 30.0 * number(3 + i + j),
        _ => 0.0,
    };
    let stiffness = SparseMatrix::from_dense(&DMatrix::from_fn(size, size, entry));
    SceneInput {
        mass: Mass::Lumped((0..size).map(|i| 1.0 + number(i + 5).abs()).collect()),
        damping: match general {
            true => Damping::General(stiffness.scaled(0.002)),
            false => Damping::Proportional { mass: 0.1, stiffness: 1e-3 },
        },
        stiffness,
        force: (0..size).map(number).collect(),
        ..Default::default()
    }
}

fn input(size: usize, numbers: &[f64], states: &[ContactState], general: bool) -> SceneInput {
    let contact = |(i, state): (usize, &ContactState)| ContactInput {
        tangential: Some(Direction::Dof(2 * i)),
        normal_force: 1.0 + 5.0 * numbers[(i + 2) % numbers.len()].abs(),
        slider_speed: SPEED,
        state: Some(state.clone()),
        ..Default::default()
    };
    let contacts = states.iter().enumerate().map(contact).collect();
    SceneInput { contacts, ..structure(size, numbers, general) }
}

fn bristles() -> impl Strategy<Value = Bristles> {
    let stiffness = (1.0..5.0f64).prop_map(|power| 10f64.powf(power));
    let levels = (0.1..1.0f64, 0.1..1.0f64, any::<bool>());
    let hysteresis = proptest::option::weighted(0.4, (1..=3usize, 0.0..1.0f64));
    (stiffness, 0.0..2.0f64, 0.0..0.5f64, levels, 0.02..1.0f64, hysteresis).prop_map(
        |(stiffness, damping, viscous, (kinetic, at_rest, falls), speed, hysteresis)| Bristles {
            stiffness,
            damping: damping / stiffness.sqrt(),
            viscous,
            kinetic,
            at_rest: if falls && hysteresis.is_none() { at_rest } else { kinetic },
            speed,
            hysteresis: hysteresis.map(|(exponent, share)| Hysteresis::BoucWen { exponent, share }),
        },
    )
}

/// LuGre's law by formulas; rate and state with the time of contact, whose logarithm of the slip speed needs slip; and a state
/// that follows the slip speed late.
fn formulas() -> impl Strategy<Value = StateFormulas> {
    let numbers = (0.1..1.0f64, 0.1..1.0f64, 0.02..1.0f64, 0.0..1.0f64, 1.0..4.0f64);
    (0..3usize, numbers).prop_map(|(kind, (first, second, scale, part, power))| {
        let large = 10f64.powf(power);
        // Operations of slots before; slot 0 is |s|, 1 is z, and 2 the sign of s.
        let operations = |given: &[(&str, usize, usize, f64)]| -> Vec<GivenOperation> {
            let shared = [("state", 0, 0, 0.0), ("direction", 0, 0, 0.0)];
            let all = shared.iter().chain(given);
            all.map(|&(name, a, b, number)| (name.to_owned(), a, b, number)).collect()
        };
        let [force, rate] = match kind {
            0 => {
                let rate = [
                    ("multiply", 2, 0, 0.0),
                    ("constant", 0, 0, -1.0 / (scale * scale)),
                    ("multiply", 0, 0, 0.0),
                    ("multiply", 4, 5, 0.0),
                    ("exp", 6, 0, 0.0),
                    ("constant", 0, 0, (second - first) / large),
                    ("multiply", 7, 8, 0.0),
                    ("constant", 0, 0, first / large),
                    ("add", 9, 10, 0.0),
                    ("multiply", 0, 1, 0.0),
                    ("divide", 12, 11, 0.0),
                    ("subtract", 3, 13, 0.0),
                ];
                let force = [
                    ("constant", 0, 0, part / large.sqrt()),
                    ("multiply", 14, 15, 0.0),
                    ("constant", 0, 0, large),
                    ("multiply", 1, 17, 0.0),
                    ("add", 16, 18, 0.0),
                ];
                let force: Vec<_> = rate.into_iter().chain(force).collect();
                [operations(&force), operations(&rate)]
            }
            1 => [
                operations(&[
                    ("log", 0, 0, 0.0),
                    ("constant", 0, 0, 0.02 * first),
                    ("multiply", 3, 4, 0.0),
                    ("log", 1, 0, 0.0),
                    ("constant", 0, 0, 0.02 * second),
                    ("multiply", 6, 7, 0.0),
                    ("constant", 0, 0, 0.5),
                    ("add", 9, 8, 0.0),
                    ("add", 10, 5, 0.0),
                    ("multiply", 11, 2, 0.0),
                ]),
                operations(&[
                    ("constant", 0, 0, 1.0),
                    ("multiply", 0, 1, 0.0),
                    ("constant", 0, 0, scale),
                    ("divide", 4, 5, 0.0),
                    ("subtract", 3, 6, 0.0),
                ]),
            ],
            _ => [
                operations(&[
                    ("tanh", 1, 0, 0.0),
                    ("constant", 0, 0, first),
                    ("multiply", 3, 4, 0.0),
                ]),
                operations(&[
                    ("multiply", 2, 0, 0.0),
                    ("constant", 0, 0, scale),
                    ("divide", 3, 4, 0.0),
                    ("subtract", 5, 1, 0.0),
                    ("constant", 0, 0, large / 100.0),
                    ("multiply", 6, 7, 0.0),
                ]),
            ],
        };
        StateFormulas::new(&force, &rate).expect("operations")
    })
}

/// Loops by formulas in pieces, as under a normal force that changes.
fn loops() -> impl Strategy<Value = ContactState> {
    let elastic = (bristles(), 0.1..0.9f64).prop_map(|(numbers, break_away)| Bristles {
        at_rest: numbers.kinetic,
        hysteresis: Some(Hysteresis::ElastoPlastic { break_away }),
        ..numbers
    });
    let turned = bristles().prop_filter("a loop", |numbers| numbers.hysteresis.is_some());
    prop_oneof![elastic, turned]
        .prop_map(|numbers| ContactState::Bristles(numbers).pressed().expect("operations"))
}

fn states() -> impl Strategy<Value = ContactState> {
    prop_oneof![
        loops(),
        bristles().prop_map(ContactState::Bristles),
        formulas().prop_map(|formulas| ContactState::Formulas(Arc::new(formulas))),
    ]
}

static MET: AtomicUsize = AtomicUsize::new(0);
static COMPARED: AtomicUsize = AtomicUsize::new(0);
static FOLLOWED: AtomicUsize = AtomicUsize::new(0);
static BESIDE: AtomicUsize = AtomicUsize::new(0);

/// `make fuzz-panels N=4000` draws more than 10 000 of them.
#[test]
fn bounds_beside_states_are_never_below_true_errors() {
    panels_within_their_bounds();
    let panels = MET.load(Ordering::Relaxed);
    let compared = COMPARED.load(Ordering::Relaxed);
    let followed = FOLLOWED.load(Ordering::Relaxed);
    let beside = BESIDE.load(Ordering::Relaxed);
    println!(
        "{panels} panels, {followed} of them with a deflection that follows, {beside} beside springs and dampers, \
         {compared} values compared"
    );
    assert!(compared > panels && followed > 0 && beside > 0);
}

proptest! {
    fn panels_within_their_bounds(
        numbers in proptest::collection::vec(-1.0..1.0f64, 11),
        start in proptest::collection::vec(-1.0..1.0f64, 7),
        size in 3..14usize,
        states in proptest::collection::vec(states(), 1..=2),
        elements in proptest::collection::vec(element(), 0..=2),
        general in any::<bool>(),
        places in proptest::collection::vec(0.0..1.0f64, 3),
    ) {
        let count = states.len();
        let input = input(size, &numbers, &states, general);
        let scene = Scene::new(input.clone()).expect("well-posed");
        let Ok(scene) = scene.with_elements(&elements) else { return Ok(()) };
        let combination = Combination::parse(&"+".repeat(count), count).expect("letters");
        let basis = CombinationBasis::new(&scene, &combination, Wanted::Series).expect("a basis");
        let Propagator::Law(operator) = &basis.propagator else { panic!("not by its law") };
        let functions = &basis.functions;
        let (mut q, mut u) = (vec![0.0; scene.size], vec![0.0; scene.size]);
        for i in 0..size {
            (q[i], u[i]) = (0.02 * start[i % 7], 0.4 * start[(i + 3) % 7]);
        }
        for (k, (_, own)) in scene.state_contacts().enumerate() {
            // The time of contact is positive.
            let part = match &own.law {
                ContactState::Formulas(formulas)
                    if formulas.in_status(Status::Positive).knots.is_empty() =>
                {
                    1.0 + 0.5 * start[k]
                }
                _ => start[k],
            };
            u[own.coordinate] = part * own.steady_rate(-SPEED);
        }
        if scene.undefined_element(&q, &u).is_some() {
            return Ok(());
        }
        let mut motion = LawMotion::default();
        motion.restart(&scene, operator, functions, &q, &u);
        let mut panel = Panel::default();
        // A panel begins where the one before has ended, although a deflection that follows begins at its balance.
        for _ in 0..PANELS {
            motion.expand(operator, functions, &mut panel);
            MET.fetch_add(1, Ordering::Relaxed);
            FOLLOWED.fetch_add(usize::from(motion.has_followed_state()), Ordering::Relaxed);
            let defined = || !matches!(motion.exhausted(), Some((LawOf::Element(_), _)));
            prop_assert!(panel.is_bounded() || !defined());
            if !panel.is_bounded() {
                break;
            }
            BESIDE.fetch_add(usize::from(scene.has_elements()), Ordering::Relaxed);
            if scene.contacts.iter().any(|one| u[one.tangential] >= SPEED) {
                break;
            }
            let doubled = |x: &[f64]| x[..size].iter().map(|&x| Doubled::from(x)).collect();
            let deflection = |own: &StateContact| {
                Doubled::from(u[own.coordinate]).over(own.scale.into())
            };
            let bent = scene.state_contacts().map(|(_, own)| deflection(own)).collect();
            let begun: State = [doubled(&q), doubled(&u), bent];
            for &place in places.iter().chain(&[1.0]) {
                let mut state = begun.clone();
                moved(&scene, &input, &mut state, place * panel.width);
                let (mut q, mut u) = (q.clone(), u.clone());
                motion.state(operator, place * panel.width, &mut q, &mut u);
                for one in &operator.contacts {
                    let (LawOf::Contact(k) | LawOf::Deflection(k)) = one.of else { continue };
                    let t = scene.contacts[k].tangential;
                    let slip = state[1][t].add((-SPEED).into());
                    let speed = slip.times(if one.has_sign() { -1.0 } else { 1.0 });
                    let expected = match one.has_sign() {
                        true => [state[2][k], speed],
                        false => [speed, state[2][k]],
                    };
                    let second = match &one.state {
                        Some(state) => (&state.value, state.norm, expected[1]),
                        None => (&one.normal, one.normal_norm, expected[1]),
                    };
                    let pairs = [(&one.slip, one.slip_norm, expected[0]), second];
                    for (functional, norm, expected) in pairs {
                        let found = functional.value(&q, &u);
                        let error = expected.add((-found).into()).value().abs();
                        let rounding = ROUNDING * f64::EPSILON * functional.magnitude(&q, &u);
                        let bound = norm * motion.left_out + rounding;
                        prop_assert!(error <= bound, "{error:e} above {bound:e} at {place} of {states:?}");
                        prop_assert!(bound < 1e-9 * functional.magnitude(&q, &u).max(norm), "{bound:e}");
                        COMPARED.fetch_add(1, Ordering::Relaxed);
                    }
                }
            }
            motion.state(operator, panel.width, &mut q, &mut u);
            motion.advance(&scene, operator);
        }
    }
}
