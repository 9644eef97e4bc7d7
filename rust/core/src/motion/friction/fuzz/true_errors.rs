//! True errors of panels, by the same motion in doubled precision on a fourth of the width, beside their bounds.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::DMatrix;
use proptest::prelude::*;

use crate::contact::contact_forces::response;
use crate::contact::event_function::EventFunction;
use crate::linalg::sparse::SparseMatrix;
use crate::motion::combination_basis::{CombinationBasis, Propagator};
use crate::motion::friction::motion::LawMotion;
use crate::motion::friction::operator::LawOperator;
use crate::motion::method::Wanted;
use crate::motion::panel::Panel;
use crate::numerics::double_double::Doubled;
use crate::numerics::first_root::polynomial::{COEFFICIENTS, ROW};
use crate::scene::contact_law::{Contact, ContactInput, Direction};
use crate::scene::elements::element::{Element, ElementInput, ElementKind, ElementPlace};
use crate::scene::friction::decay::Decay;
use crate::scene::friction::formula::{GivenOperation, Operation};
use crate::scene::friction::law::{FrictionLaw, Table};
use crate::scene::input::scene_input::{Damping, Mass, SceneInput};
use crate::scene::model::Scene;
use crate::scene::status::Combination;

/// Masses and contacts: the first contact slides along dof 0, pressed by dof 1, the second one along dof 2, pressed by dof 3.
/// The recurrences keep a few of them in registers, multiply others by rows, and take a chain, the last one, entry by entry.
const SIZES: [(usize, usize); 8] =
    [(3, 1), (5, 2), (6, 1), (10, 2), (12, 1), (14, 2), (18, 1), (CHAIN, 2)];
const CHAIN: usize = 64;
/// Largest difference of two recurrences, relative to the largest coefficient of any order.
const DIFFERENCE: f64 = 1e-13;
/// Friction of a contact without a law.
const CONSTANT: f64 = 0.3;
/// Newton's steps to a slip speed in doubled precision.
const SOLVED: usize = 8;
/// Steps and terms of the reference: its rest is below 1e-28 of the motion.
pub(super) const STEPS: usize = 4;
pub(super) const TERMS: usize = 28;

/// Of what the exponential is nothing beside 1, in doubled precision.
const VANISHES: f64 = -100.0;

pub(super) fn exp(x: Doubled) -> Doubled {
    // Its series is one of small numbers.
    if x.value() < VANISHES {
        return Doubled::default();
    }
    let mut part = x.times(1.0 / 1024.0);
    let small = part;
    let mut sum = Doubled::from(1.0).add(part);
    for k in 2..16 {
        part = part.by(small).over(Doubled::from(k as f64));
        sum = sum.add(part);
    }
    (0..10).fold(sum, |power, _| power.by(power))
}

fn ln(x: Doubled) -> Doubled {
    let near = Doubled::from(x.value().ln());
    let power = exp(near);
    let off = x.add(power.times(-1.0)).over(x.add(power));
    near.add(off.times(2.0))
}

fn sine_and_cosine(x: Doubled) -> [Doubled; 2] {
    let small = x.times(1.0 / 1024.0);
    let (mut part, mut parts) = (Doubled::from(1.0), [Doubled::default(), Doubled::from(1.0)]);
    for k in 1..24 {
        part = part.by(small).over(Doubled::from(k as f64));
        let sign = if k % 4 < 2 { 1.0 } else { -1.0 };
        parts[(k + 1) % 2] = parts[(k + 1) % 2].add(part.times(sign));
    }
    (0..10).fold(parts, |[sine, cosine], _| {
        let turned = sine.by(sine).times(-1.0);
        [sine.by(cosine).times(2.0), cosine.by(cosine).add(turned)]
    })
}

fn arctan(x: Doubled) -> Doubled {
    let near = Doubled::from(x.value().atan());
    let [sine, cosine] = sine_and_cosine(near);
    // The angle that is left is as small as its tangent.
    let off = x.by(cosine).add(sine.times(-1.0));
    near.add(off.over(cosine.add(x.by(sine))))
}

/// The coefficient of order k of every slot of a formula, behind those of lower orders.
pub(super) fn slots(
    operations: &[Operation],
    slip: &[Doubled],
    state: &[Doubled],
    inner: &mut Vec<Doubled>,
) {
    let (k, n) = (slip.len() - 1, operations.len());
    let order = Doubled::from(k as f64);
    let mut own: Vec<Doubled> = Vec::new();
    for (place, operation) in operations.iter().enumerate() {
        let of = |slot: usize, i: usize| match slot {
            0 => slip[i],
            _ if i < k => inner[i * n + slot - 1],
            _ => own.get(slot - 1).copied().unwrap_or_default(),
        };
        let here = |i: usize| if i < k { inner[i * n + place] } else { Doubled::default() };
        let sum = |term: &dyn Fn(usize) -> Doubled, first: usize| {
            (first..=k).fold(Doubled::default(), |sum, i| sum.add(term(i)))
        };
        let at_start = |value: f64| Doubled::from(if k == 0 { value } else { 0.0 });
        let minus = |x: Doubled| x.times(-1.0);
        let next = match *operation {
            Operation::Constant(value) => at_start(value),
            Operation::State => state[k],
            Operation::Affine { of: slot, factor, shift } => {
                of(slot, k).times(factor).add(at_start(shift))
            }
            Operation::Sum(a, b) => of(a, k).add(of(b, k)),
            Operation::Product(a, b) => sum(&|i| of(a, i).by(of(b, k - i)), 0),
            Operation::Quotient(a, b) => {
                let lower = sum(&|i| of(b, i).by(here(k - i)), 1);
                of(a, k).add(minus(lower)).over(of(b, 0))
            }
            Operation::Exponential(a) if k == 0 => exp(of(a, 0)),
            Operation::Exponential(a) => {
                sum(&|i| of(a, i).times(i as f64).by(here(k - i)), 1).over(order)
            }
            Operation::Logarithm(a) if k == 0 => ln(of(a, 0)),
            Operation::Logarithm(a) => {
                let lower = sum(&|i| here(i).times(i as f64).by(of(a, k - i)), 1).over(order);
                of(a, k).add(minus(lower)).over(of(a, 0))
            }
            Operation::Power(a, exponent) if k == 0 => exp(ln(of(a, 0)).times(exponent)),
            Operation::Power(a, exponent) => {
                let weight = |i: usize| {
                    Doubled::product(exponent, i as f64).add((i as f64 - k as f64).into())
                };
                sum(&|i| weight(i).by(of(a, i)).by(here(k - i)), 1).over(order).over(of(a, 0))
            }
            Operation::Tangent(a) if k == 0 => {
                let sign = f64::signum(of(a, 0).value());
                let power = exp(of(a, 0).times(-2.0 * sign));
                let one = Doubled::from(1.0);
                one.add(minus(power)).over(one.add(power)).times(sign)
            }
            Operation::Tangent(a) => {
                let square = |i: usize| inner[i * n + place + 1];
                let rate = |i: usize| of(a, i).times(i as f64);
                rate(k).add(minus(sum(&|i| rate(i).by(square(k - i)), 1))).over(order)
            }
            Operation::Arctangent(a, _) if k == 0 => arctan(of(a, 0)),
            Operation::Arctangent(a, more) => {
                let lower = sum(&|i| here(i).times(i as f64).by(of(more, k - i)), 1).over(order);
                of(a, k).add(minus(lower)).over(of(more, 0))
            }
            Operation::Sine(a) if k == 0 => sine_and_cosine(of(a, 0))[0],
            Operation::Cosine(a) if k == 0 => sine_and_cosine(of(a, 0))[1],
            Operation::Sine(a) | Operation::Cosine(a) => {
                let (other, sign) = match operation {
                    Operation::Sine(_) => (place + 1, 1.0),
                    _ => (place - 1, -1.0),
                };
                let term =
                    |i: usize| of(a, i).times(sign * i as f64).by(inner[(k - i) * n + other]);
                sum(&term, 1).over(order)
            }
        };
        own.push(next);
    }
    inner.extend(own);
}

/// Coefficients of mu(S), those of S up to order k being known.
pub(super) fn extend(
    law: &FrictionLaw,
    piece: usize,
    slip: &[Doubled],
    inner: &mut Vec<Doubled>,
    mu: &mut Vec<Doubled>,
) {
    let k = slip.len() - 1;
    let at = |value: f64| Doubled::from(if k == 0 { value } else { 0.0 });
    let sum =
        |terms: &mut dyn Iterator<Item = Doubled>| terms.fold(Doubled::default(), Doubled::add);
    match law.on(piece) {
        FrictionLaw::Linear { at_rest, slope } => mu.push(slip[k].times(*slope).add(at(*at_rest))),
        FrictionLaw::Decaying { at_rest, kinetic, speed, viscous, decay } => {
            let next = if *decay == Decay::Exponential {
                match k {
                    0 => exp(slip[0].times(-1.0).over((*speed).into())),
                    _ => {
                        let terms =
                            &mut (1..=k).map(|j| slip[j].times(-(j as f64)).by(inner[k - j]));
                        sum(terms).over(Doubled::product(k as f64, *speed))
                    }
                }
            } else {
                assert_eq!(*decay, Decay::Rational, "no reference");
                let one = Doubled::from(1.0);
                match k {
                    0 => one.over(one.add(slip[0].over((*speed).into()))),
                    _ => {
                        let terms = &mut (1..=k).map(|j| slip[j].times(-1.0).by(inner[k - j]));
                        sum(terms).by(inner[0]).over((*speed).into())
                    }
                }
            };
            inner.push(next);
            let falling = Doubled::from(*at_rest).add((-kinetic).into());
            mu.push(falling.by(next).add(slip[k].times(*viscous)).add(at(*kinetic)));
        }
        FrictionLaw::Formula(formula) => {
            slots(formula.operations(), slip, &[], inner);
            mu.push(inner[inner.len() - 1]);
        }
        FrictionLaw::Tabulated(table) => {
            let [a, b, c, d] = table.pieces[piece];
            let knot = Doubled::from(-table.speeds[piece]);
            let far = |j: usize| if j == 0 { slip[0].add(knot) } else { slip[j] };
            let square = sum(&mut (0..=k).map(|j| far(j).by(far(k - j))));
            inner.push(far(k).times(c).add(square.times(d)).add(at(b)));
            mu.push(sum(&mut (0..=k).map(|j| far(j).by(inner[k - j]))).add(at(a)));
        }
        FrictionLaw::Pieces(_) => unreachable!("a piece of pieces"),
    }
}

/// The next order of the slip speed of a contact whose slip has no mass, from `mu(S) N + load = 0`. The first is near a given
/// speed, and in order k this is `mu'(S_0) N_0 S_k` and terms of lower orders.
fn balance(
    law: &FrictionLaw,
    piece: usize,
    load: Doubled,
    near: Doubled,
    [slip, normal, inner, mu]: &mut [Vec<Doubled>; 4],
) {
    let one_more = |start: &[Doubled], next: Doubled| {
        let (mut slip, mut inner, mut mu) = (Vec::new(), Vec::new(), Vec::new());
        for &speed in start.iter().chain([&next]) {
            slip.push(speed);
            extend(law, piece, &slip, &mut inner, &mut mu);
        }
        mu
    };
    let left = |mu: &[Doubled]| {
        let products = mu.iter().zip(normal.iter().rev()).map(|(mu, normal)| mu.by(*normal));
        products.fold(load, Doubled::add)
    };
    let slope = |speed: Doubled| one_more(&[speed], 1.0.into())[1].by(normal[0]).times(-1.0);
    let off = |speed: Doubled| left(&one_more(&[], speed));
    let speed = match slip.first() {
        None => (0..SOLVED).fold(near, |speed, _| speed.add(off(speed).over(slope(speed)))),
        Some(&first) => left(&one_more(slip, Doubled::default())).over(slope(first)),
    };
    slip.push(speed);
    extend(law, piece, slip, inner, mu);
}

/// The argument of an element, or its coefficient of a higher order.
pub(super) fn argument_of(one: &Element, [q, u]: [&[Doubled]; 2], at_start: bool) -> Doubled {
    let x = if one.kind == ElementKind::Spring { q } else { u };
    let start = Doubled::from(if at_start { -one.offset } else { 0.0 });
    one.direction.iter().fold(start, |sum, &(k, weight)| sum.add(x[k].times(weight)))
}

/// psi of every element in a state.
fn forces_of_elements(scene: &Scene, state: &[Vec<Doubled>; 2]) -> Vec<Doubled> {
    let force = |one: &Element| {
        let argument = argument_of(one, [&state[0], &state[1]], true);
        let (mut inner, mut force) = (Vec::new(), Vec::new());
        extend(&one.excess, 0, &[argument], &mut inner, &mut force);
        force[0]
    };
    scene.nonlinear_elements().map(|(_, one)| force(one)).collect()
}

/// (q, q') a time `width` later, each contact by its law, in the piece of the table given.
fn moved(scene: &Scene, laws: &[(FrictionLaw, usize)], state: &mut [Vec<Doubled>; 2], width: f64) {
    let size = scene.size;
    let elements = scene.elements();
    for _ in 0..STEPS {
        let mut q: Vec<Vec<Doubled>> = vec![state[0].clone()];
        let mut u: Vec<Vec<Doubled>> = vec![state[1].clone()];
        let mut series = vec![[const { Vec::<Doubled>::new() }; 4]; laws.len()];
        let mut of_elements = vec![[const { Vec::<Doubled>::new() }; 3]; elements.len()];
        for k in 0..TERMS {
            let residual = |row: usize| {
                let load = Doubled::from(if k == 0 { scene.force[row] } else { 0.0 });
                let springs = scene.stiffness.row(row).map(|(j, value)| q[k][j].times(-value));
                let dampers = scene.damping.row(row).map(|(j, value)| u[k][j].times(-value));
                springs.chain(dampers).fold(load, Doubled::add)
            };
            let order = Doubled::from((k + 1) as f64);
            let mut loads: Vec<Doubled> = (0..size).map(residual).collect();
            for (one, [argument, inner, force]) in elements.iter().zip(&mut of_elements) {
                argument.push(argument_of(one, [&q[k], &u[k]], k == 0));
                extend(&one.excess, 0, argument, inner, force);
                for &(row, weight) in &one.direction {
                    loads[row] = loads[row].add(force[k].times(-weight));
                }
            }
            let contacts = scene.contacts.iter().zip(laws).zip(&mut series);
            for ((contact, (law, piece)), own) in contacts {
                let (t, n) = (contact.tangential, contact.normal);
                let speed = Doubled::from(if k == 0 { contact.slider_speed } else { 0.0 });
                own[1].push(loads[n].times(-1.0));
                let relative = speed.add(u[k][t].times(-1.0));
                if contact.tangential_has_mass() {
                    let [slip, normal, inner, mu] = own;
                    slip.push(relative);
                    extend(law, *piece, slip, inner, mu);
                    loads[t] = (0..=k).fold(loads[t], |sum, j| sum.add(mu[j].by(normal[k - j])));
                } else {
                    balance(law, *piece, loads[t], relative, own);
                    u[k][t] = speed.add(own[0][k].times(-1.0));
                    loads[t] = Doubled::default();
                }
                loads[n] = Doubled::default();
            }
            let next = |row: usize| match scene.mass.get(row, row) {
                0.0 => Doubled::default(),
                mass => loads[row].over(mass.into()).over(order),
            };
            let accelerated: Vec<Doubled> = (0..size).map(next).collect();
            q.push(u[k].iter().map(|v| v.over(order)).collect());
            u.push(accelerated);
        }
        let step = width / STEPS as f64;
        for (sum, terms) in state.iter_mut().zip([&q, &u]) {
            for (j, sum) in sum.iter_mut().enumerate() {
                let horner = |value: Doubled, term: &Vec<Doubled>| value.times(step).add(term[j]);
                *sum = terms.iter().rev().fold(Doubled::default(), horner);
            }
        }
    }
}

/// A law of random operations that is no steeper than those of other kinds.
fn formula() -> impl Strategy<Value = FrictionLaw> {
    const NAMES: [&str; 11] = [
        "constant", "add", "multiply", "divide", "exp", "log", "power", "tanh", "arctan", "sin",
        "cos",
    ];
    let drawn =
        (0..NAMES.len(), any::<prop::sample::Index>(), any::<prop::sample::Index>(), -2.0..2.0f64);
    let tape = proptest::collection::vec(drawn, 1..10);
    (tape, 0.2..1.0f64, -0.5..0.5f64).prop_filter_map("steep", |(tape, at_rest, size)| {
        let mut given: Vec<GivenOperation> = Vec::new();
        for (name, first, second, number) in tape {
            let count = given.len() + 1;
            // The slots before the last are not all met: one of both is near.
            let near = count - 1 - first.index(count.min(3));
            let exponent = if number > 0.0 { (2.0 * number).round() } else { number };
            given.push((
                NAMES[name].into(),
                near,
                second.index(count),
                match NAMES[name] {
                    "power" => exponent,
                    _ => number,
                },
            ));
        }
        let last = given.len();
        given.push(("constant".into(), 0, 0, size));
        given.push(("multiply".into(), last, last + 1, 0.0));
        given.push(("constant".into(), 0, 0, at_rest));
        given.push(("add".into(), last + 2, last + 3, 0.0));
        let law = FrictionLaw::formula(&given).expect("operations in order");
        let near = |k: i32| {
            let speed = 0.1 * f64::from(k);
            law.value(speed).abs() < 2.0 && law.slope(speed).abs() < 20.0
        };
        (law.validate(0).is_ok() && (0..12).all(near)).then_some(law)
    })
}

pub(super) fn law() -> impl Strategy<Value = FrictionLaw> {
    // Without a jump: there a slip speed could stay at the border of two pieces.
    let table = |[a, b, c]: [f64; 3]| {
        let end = |[a, b, c, d]: [f64; 4], x: f64| a + x * (b + x * (c + x * d));
        let first = [a, b, c, -c];
        let second = [end(first, 0.2), 0.0, b, -0.2 * b];
        let pieces = vec![first, second, [end(second, 0.4), 0.0, 0.0, 0.0]];
        FrictionLaw::Tabulated(Arc::new(Table { speeds: vec![0.0, 0.2, 0.6], pieces }))
    };
    prop_oneof![
        1 => (0.1..1.0f64, -0.5..0.5f64)
            .prop_map(|(at_rest, slope)| FrictionLaw::Linear { at_rest, slope }),
        2 => (0.1..1.0f64, 0.1..1.0f64, 0.01..1.0f64, 0.0..0.5f64, any::<bool>()).prop_map(
            |(at_rest, kinetic, speed, viscous, rational)| {
                let decay = if rational { Decay::Rational } else { Decay::Exponential };
                FrictionLaw::Decaying { at_rest, kinetic, speed, viscous, decay }
            }
        ),
        2 => [0.2..0.6f64, -0.1..0.1f64, -0.3..0.3f64].prop_map(table),
        3 => formula(),
    ]
}

/// Springs and dampers between two dofs, with an offset.
pub(super) fn element() -> impl Strategy<Value = ElementInput> {
    let ends = (any::<prop::sample::Index>(), any::<prop::sample::Index>());
    (formula(), ends, -1.0..1.0f64, any::<bool>()).prop_map(|(law, (a, b), place, damps)| {
        // Two masses, which every scene has.
        let along = ElementPlace::Direction(vec![(a.index(3), 1.0), (b.index(3), place)]);
        match damps {
            true => {
                let kind = ElementKind::Damper;
                // A damper has no force at rest.
                let law = law.less_line([law.value(0.0), 0.0]);
                ElementInput { kind, place: along, offset: 0.0, law }
            }
            false => {
                let kind = ElementKind::Spring;
                ElementInput { kind, place: along, offset: 0.1 * place, law }
            }
        }
    })
}

/// A law that rises, as slip without mass needs it.
fn rising(law: &FrictionLaw) -> FrictionLaw {
    match *law {
        FrictionLaw::Formula(_) if law.rises_until().is_some() => law.clone(),
        FrictionLaw::Formula(_) => {
            // mu_0 + asinh(s / v) / 10
            let of =
                |name: &str, first, second, number| (String::from(name), first, second, number);
            let operations = [
                of("constant", 0, 0, 0.05),
                of("divide", 0, 1, 0.0),
                of("power", 2, 0, 2.0),
                of("constant", 0, 0, 1.0),
                of("add", 3, 4, 0.0),
                of("power", 5, 0, 0.5),
                of("add", 2, 6, 0.0),
                of("log", 7, 0, 0.0),
                of("constant", 0, 0, 0.1),
                of("multiply", 8, 9, 0.0),
                of("constant", 0, 0, law.value(0.0)),
                of("add", 10, 11, 0.0),
            ];
            FrictionLaw::formula(&operations).expect("operations in order")
        }
        FrictionLaw::Decaying { at_rest, kinetic, speed, viscous, decay } => {
            let kinetic = at_rest + kinetic;
            FrictionLaw::Decaying { at_rest, kinetic, speed, viscous, decay }
        }
        FrictionLaw::Linear { at_rest, slope } => {
            FrictionLaw::Linear { at_rest, slope: 0.1 + slope.abs() }
        }
        FrictionLaw::Tabulated(ref table) => {
            let [a, b, c, _] = table.pieces[0];
            let (b, c) = (0.1 + b.abs(), c.abs());
            let [first, second] = [0.2, 0.6].map(|x| a + x * (b + x * c));
            let pieces =
                vec![[a, b, c, 0.0], [first, b + 0.4 * c, c, 0.0], [second, 0.0, 0.0, 0.0]];
            FrictionLaw::Tabulated(Arc::new(Table { speeds: table.speeds.clone(), pieces }))
        }
        FrictionLaw::Pieces(_) => unreachable!("a law of springs"),
    }
}

/// Contacts under laws; the second one of constant friction where only one law is given. With a `pull` the first contact has
/// no mass, and this is the force along it.
fn scene(
    (size, count): (usize, usize),
    numbers: &[f64],
    damping: Damping,
    laws: &[FrictionLaw],
    pull: Option<f64>,
) -> Scene {
    let number = |place: usize| numbers[place % numbers.len()];
    let near = if size == CHAIN { 4 } else { size };
    let entry = |i: usize, j: usize| match i.abs_diff(j) {
        0 => 100.0 * (1.5 + number(i)),
        off if off < near => 120.0 / near as f64 * number(3 + i + j + i * j),
        _ => 0.0,
    };
    let contact = |i: usize| ContactInput {
        tangential: Some(Direction::Dof(2 * i)),
        normal: Some(Direction::Dof(2 * i + 1)),
        friction: laws.get(i).map_or(CONSTANT, |law| law.value(0.0)),
        static_friction: laws.get(i).map_or(CONSTANT, |law| law.value(0.0)),
        slider_speed: 0.5,
        ..Default::default()
    };
    let scene = Scene::new(SceneInput {
        mass: Mass::Lumped(
            (0..size)
                .map(|i| if i < 2 && pull.is_some() { 0.0 } else { 1.0 + number(i + 5).abs() })
                .collect(),
        ),
        stiffness: SparseMatrix::from_dense(&DMatrix::from_fn(size, size, entry)),
        damping,
        force: (0..size)
            .map(|i| match pull {
                Some(pull) if i == 0 => pull,
                _ if i % 2 == 1 && i < 2 * count => -10.0,
                _ => number(i),
            })
            .collect(),
        contacts: (0..count).map(contact).collect(),
        ..Default::default()
    });
    let laws = (0..count).map(|i| laws.get(i).cloned()).collect();
    scene.and_then(|scene| scene.with_friction_laws(laws)).expect("well-posed")
}

/// `beta K`, `alpha M + beta K`, or a matrix that is neither.
fn damping(kind: usize, size: usize, share: f64) -> Damping {
    let entry = |i: usize, j: usize| match i.abs_diff(j) {
        0 => 100.0 * share * (1.0 + (i % 3) as f64),
        1 => -30.0 * share,
        _ => 0.0,
    };
    match kind {
        0 => Damping::Proportional { mass: 0.0, stiffness: share },
        1 => Damping::Proportional { mass: 50.0 * share, stiffness: share },
        _ => Damping::General(SparseMatrix::from_dense(&DMatrix::from_fn(size, size, entry))),
    }
}

/// The pieces of tables in which a motion spends a panel: those of the start, or where it begins at the border of two the one in
/// which it then is half-way.
fn pieces(
    scene: &Scene,
    laws: &[FrictionLaw],
    state: &[Vec<Doubled>; 2],
    width: f64,
) -> Vec<(FrictionLaw, usize)> {
    let piece = |law: &FrictionLaw, contact: &Contact, u: &[Doubled]| match law {
        FrictionLaw::Tabulated(table) => {
            let slip = Doubled::from(contact.slider_speed).add(u[contact.tangential].times(-1.0));
            table.piece(slip.value())
        }
        _ => 0,
    };
    let along = |u: &[Doubled]| -> Vec<(FrictionLaw, usize)> {
        let pairs = laws.iter().zip(&scene.contacts);
        pairs.map(|(law, contact)| (law.clone(), piece(law, contact, u))).collect()
    };
    let constant = FrictionLaw::Linear { at_rest: CONSTANT, slope: 0.0 };
    let mut tried = along(&state[1]);
    tried.resize(scene.contacts.len(), (constant.clone(), 0));
    let mut middle = state.clone();
    moved(scene, &tried, &mut middle, 0.5 * width);
    let mut found = along(&middle[1]);
    found.resize(scene.contacts.len(), (constant, 0));
    found
}

/// The largest difference of an order of the state by dense rows from that by the equation of motion, relative to this order.
fn difference_of_rows(
    scene: &Scene,
    combination: &Combination,
    functions: &[EventFunction],
    [q, u]: [&[f64]; 2],
) -> f64 {
    let operator = || LawOperator::new(scene, combination, functions).expect("an operator");
    // On the panel that its bound allows.
    let mut motion = LawMotion::default();
    motion.restart(scene, &operator(), functions, q, u);
    let part = (motion.end() - motion.start()) / operator().taylor.width();
    let orders = |by_rows: bool| -> Vec<Vec<f64>> {
        let mut operator = operator();
        if !by_rows {
            operator.taylor.dense = None;
        }
        let mut motion = LawMotion::default();
        motion.begin(scene, &operator, functions, q, u);
        motion.taylor.begin_within(part);
        motion.recur(scene, &operator);
        (0..COEFFICIENTS).map(|k| motion.taylor.orders(k)[1].to_vec()).collect()
    };
    let largest = |x: &mut dyn Iterator<Item = f64>| x.fold(0.0, |all: f64, x| all.max(x.abs()));
    let [found, general] = [true, false].map(|by_rows| orders(by_rows).concat());
    let off = largest(&mut found.iter().zip(&general).map(|(a, b)| a - b));
    let size = largest(&mut general.iter().copied());
    if size > 0.0 { off / size } else { off }
}

static KNOTS: AtomicUsize = AtomicUsize::new(0);
static PANELS: AtomicUsize = AtomicUsize::new(0);
static WITH_ELEMENTS: AtomicUsize = AtomicUsize::new(0);
static WITHOUT_MASS: AtomicUsize = AtomicUsize::new(0);
static MET: [AtomicUsize; SIZES.len()] = [const { AtomicUsize::new(0) }; SIZES.len()];

/// `make fuzz-panels N=4000` draws more than 10 000 of them.
#[test]
fn bounds_are_never_below_true_errors() {
    panels_within_their_bounds();
    let panels = PANELS.load(Ordering::Relaxed);
    let without_mass = WITHOUT_MASS.load(Ordering::Relaxed);
    println!(
        "{panels} panels of {MET:?} scenes, {KNOTS:?} of them from beside a speed of a table, {without_mass} of them where slip has no mass"
    );
    let with_elements = WITH_ELEMENTS.load(Ordering::Relaxed);
    println!("{with_elements} of them beside springs and dampers");
    assert!(panels > without_mass && without_mass > 0 && with_elements > 0);
}

proptest! {
    fn panels_within_their_bounds(
        numbers in proptest::collection::vec(-1.0..1.0f64, 11),
        start in proptest::collection::vec(-1.0..1.0f64, 7),
        of_size in 0..SIZES.len(),
        share in 0.0..0.01f64,
        kind in 0..3usize,
        without_mass in proptest::bool::weighted(0.3),
        laws in proptest::collection::vec(law(), 1..=2),
        places in proptest::collection::vec(0.0..1.0f64, 3),
        knot in proptest::option::of((-13.0..-8.0f64, proptest::bool::ANY)),
        elements in proptest::collection::vec(element(), 0..=3),
    ) {
        let (size, count) = SIZES[of_size];
        let mut laws = laws[..laws.len().min(count)].to_vec();
        MET[of_size].fetch_add(1, Ordering::Relaxed);
        let pressed = |i: usize| i % 2 == 1 && i < 2 * count;
        let draw = |scale: f64, first: usize| -> Vec<f64> {
            let of = |i: usize| if pressed(i) { 0.0 } else { scale * start[(first + i) % 7] };
            (0..size).map(of).collect()
        };
        let (q, mut u) = (draw(0.02, 0), draw(0.4, 3));
        // A start beside a speed of a table.
        if let (false, Some((power, above)), FrictionLaw::Tabulated(_)) = (without_mass, knot, &laws[0]) {
            let apart = 10f64.powf(power);
            u[0] = 0.5 - 0.2 * if above { 1.0 + apart } else { 1.0 - apart };
            KNOTS.fetch_add(1, Ordering::Relaxed);
        }
        let pull = without_mass.then(|| {
            laws[0] = rising(&laws[0]);
            let at = scene((size, count), &numbers, damping(kind % 2, size, share), &laws, Some(0.0));
            let along = |row: usize, x: &[f64]| -> f64 {
                at.stiffness.row(row).map(|(k, value)| value * x[k]).sum()
            };
            let fastest = laws[0].rises_until().expect("a law that rises").min(1.0);
            let speed = (0.1 + 0.6 * places[2]) * fastest;
            let damped: f64 = at.damping.row(1).map(|(k, value)| value * u[k]).sum();
            let pressed = along(1, &q) + damped - at.force[1];
            along(0, &q) - laws[0].value(speed) * pressed
        });
        let kind = if without_mass { kind % 2 } else { kind };
        let scene = scene((size, count), &numbers, damping(kind, size, share), &laws, pull);
        let elements = if without_mass { &[][..] } else { &elements[..] };
        let Ok(scene) = scene.with_elements(elements) else { return Ok(()) };
        if scene.undefined_element(&q, &u).is_some() {
            return Ok(());
        }
        let combination = Combination::parse(&"+".repeat(count), count).expect("letters");
        let basis = CombinationBasis::new(&scene, &combination, Wanted::Series).expect("a basis");
        let Propagator::Law(operator) = &basis.propagator else { panic!("not by its law") };
        let (functions, scene) = (&basis.functions, basis.scene(&scene));
        let response = response(scene, &combination);
        let mut motion = LawMotion::default();
        motion.restart(scene, operator, functions, &q, &u);
        if !without_mass {
            let difference = difference_of_rows(scene, &combination, functions, [&q, &u]);
            prop_assert!(difference < DIFFERENCE, "{difference:e}");
        }
        let mut panel = Panel::default();
        for _ in 0..3 {
            motion.expand(operator, functions, &mut panel);
            PANELS.fetch_add(1, Ordering::Relaxed);
            WITH_ELEMENTS.fetch_add(usize::from(scene.has_elements()), Ordering::Relaxed);
            WITHOUT_MASS.fetch_add(usize::from(without_mass), Ordering::Relaxed);
            if !panel.is_bounded() {
                // A law that falls to 0.
                break;
            }
            let (mut q, mut u) = (vec![0.0; size], vec![0.0; size]);
            motion.state(operator, 0.0, &mut q, &mut u);
            let ended = |one: &Contact| u[one.tangential] >= one.slider_speed;
            if scene.contacts.iter().any(ended) {
                // Slip has come to an end, and the law with it.
                break;
            }
            for &place in places.iter().chain(&[1.0]) {
                let doubled = |x: &[f64]| x.iter().map(|&x| Doubled::from(x)).collect();
                let mut state: [Vec<Doubled>; 2] = [doubled(&q), doubled(&u)];
                let along = pieces(scene, &laws, &state, panel.width);
                moved(scene, &along, &mut state, place * panel.width);
                for (index, function) in functions.iter().enumerate() {
                    let terms = |terms: &[(usize, f64)], x: &[Doubled]| {
                        terms.iter().fold(Doubled::default(), |sum, &(k, w)| sum.add(x[k].times(w)))
                    };
                    let functional = &function.functional;
                    let expected = terms(&functional.position, &state[0])
                        .add(terms(&functional.velocity, &state[1]))
                        .add(functional.constant.into());
                    // The columns of elements come last.
                    let forces = forces_of_elements(scene, &state);
                    let expected = forces.iter().rev().enumerate().fold(expected, |sum, (j, psi)| {
                        let factor = response.as_ref().map_or(0.0, |all| {
                            function.response(all, all.ncols() - 1 - j)
                        });
                        sum.add(psi.times(factor))
                    });
                    if panel.excluded[index] {
                        prop_assert!(expected.value() > 0.0);
                        continue;
                    }
                    let row = &panel.coefficients[index * ROW..];
                    let horner = |value: Doubled, &c: &f64| value.times(place).add(c.into());
                    let found = row[..COEFFICIENTS].iter().rev().fold(Doubled::default(), horner);
                    let error = found.add(expected.times(-1.0)).value().abs();
                    prop_assert!(
                        error <= panel.error[index],
                        "{error:e} above {:e} at {place} of {laws:?}", panel.error[index]
                    );
                    // A bound that says nothing is none: a part of 1e-9 of the motion.
                    prop_assert!(panel.error[index] < 1e-7, "{:e}", panel.error[index]);
                }
            }
            motion.advance(scene, operator);
        }
    }
}
