//! True errors of panels with slip in planes, by extrapolated midpoint rules on the equation of motion in doubled precision.

use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::DMatrix;
use proptest::prelude::*;

use crate::linalg::dense::{max_distance, max_norm};
use crate::linalg::sparse::SparseMatrix;
use crate::motion::combination_basis::{CombinationBasis, Propagator};
use crate::motion::friction::fuzz::true_errors::{argument_of, element, extend, law};
use crate::motion::friction::motion::LawMotion;
use crate::motion::friction::plane::series::PlaneSeries;
use crate::motion::method::Wanted;
use crate::motion::panel::Panel;
use crate::numerics::double_double::Doubled;
use crate::scene::contact_law::{ContactInput, Direction};
use crate::scene::elements::element::Element;
use crate::scene::friction::law::FrictionLaw;
use crate::scene::input::scene_input::{Damping, Mass, SceneInput};
use crate::scene::model::Scene;
use crate::scene::status::Combination;

/// Panels of one motion, and parts of a panel over which a rule with so many columns is extrapolated: few, and where these seem to
/// show an error above its bound, more: where directions follow slow slips, the reference is stiff.
const PANELS: usize = 4;
const PARTS: [usize; 4] = [6, 60, 600, 6000];
const COLUMNS: usize = 10;
/// Part of a panel at which the reference of a slip that begins starts, with a drop of friction and without: its series leaves nothing
/// out there. From then on, a part is so much longer than the one before: without a drop the equation is stiff.
const BEGUN: [f64; 2] = [0.02, 0.3];
const GROWS: f64 = 1.1;
/// Normal force below which a phase counts as over, N.
const LIFTS: f64 = 0.05;
/// Times that a direction relaxes over a motion up to which its neighbours are carried by series in time too, and how far these may
/// be from those that follow, relative to the largest.
const STIFFEST: f64 = 1e4;
const ALIKE: f64 = 1e-11;
/// Half of the time over which the rate of a force is a difference, s.
const STEP: f64 = 1e-6;
/// Times that motions are drawn at most until some have neighbours that follow, as two of a hundred have.
const DRAWN: usize = 5;
/// Units of rounding of a polynomial and of a sum of a few terms.
const ROUNDING: f64 = 16.0;

type Values = Vec<Doubled>;

fn inverse_root(x: Doubled) -> Doubled {
    let mut y = Doubled::from(1.0 / x.value().sqrt());
    for _ in 0..2 {
        let left = x.by(y).by(y).times(-0.5).add(1.5.into());
        y = y.by(left);
    }
    y
}

/// Bodies and, of each, a law of friction over slip speed; constant friction where it has none. Springs and dampers beside them.
type Bodies<'a> = (&'a SceneInput, &'a [Option<FrictionLaw>], &'a [Element]);

/// `F - K x - C x'` and what springs and dampers add.
fn loads((input, _, elements): Bodies<'_>, state: &Values) -> Values {
    let size = input.force.len();
    let [_, damping, stiffness, ..] = input.matrices();
    let (x, v) = state.split_at(size);
    let row = |i: usize| {
        let springs = stiffness.row(i).map(|(j, value)| x[j].times(-value));
        let dampers = damping.row(i).map(|(j, value)| v[j].times(-value));
        springs.chain(dampers).fold(Doubled::from(input.force[i]), Doubled::add)
    };
    let mut force: Values = (0..size).map(row).collect();
    for one in elements {
        let (argument, mut excess) = (argument_of(one, [x, v], true), Vec::new());
        extend(&one.excess, 0, &[argument], &mut Vec::new(), &mut excess);
        let [at_rest, slope] = one.linear;
        let whole = excess[0].add(at_rest.into()).add(argument.times(slope));
        for &(row, weight) in &one.direction {
            force[row] = force[row].add(whole.times(-weight));
        }
    }
    force
}

/// The rates of positions and velocities, `M x'' = F - K x - C x' - phi - mu N w / |w|`, where N is given or holds a dof.
fn rates(bodies: Bodies<'_>, state: &Values) -> Values {
    let (input, laws, _) = bodies;
    let [mass, ..] = input.matrices();
    let v = &state[input.force.len()..];
    let mut force = loads(bodies, state);
    for (pair, law) in input.contacts.chunks(2).zip(laws) {
        let along = [0, 1].map(|k| {
            let Some(Direction::Dof(dof)) = pair[k].tangential else { panic!("along a dof") };
            (dof, v[dof].add((-pair[k].slider_speed).into()))
        });
        let square = along[0].1.by(along[0].1).add(along[1].1.by(along[1].1));
        let pressed = match pair[0].normal {
            Some(Direction::Dof(dof)) => std::mem::take(&mut force[dof]).times(-1.0),
            _ => pair[0].normal_force.into(),
        };
        let inverse = inverse_root(square);
        let friction = law.as_ref().map_or(pair[0].friction.into(), |law| {
            let (mut mu, speed) = (Vec::new(), square.by(inverse));
            extend(law, law.piece(speed.value()), &[speed], &mut Vec::new(), &mut mu);
            mu[0]
        });
        let factor = inverse.by(friction).times(-1.0).by(pressed);
        along.iter().for_each(|&(dof, w)| force[dof] = force[dof].add(w.by(factor)));
    }
    let accelerations = force.iter().enumerate().map(|(i, f)| f.over(mass.get(i, i).into()));
    v.iter().copied().chain(accelerations).collect()
}

fn plus(a: &Values, b: &Values, factor: f64) -> Values {
    a.iter().zip(b).map(|(a, b)| a.add(b.times(factor))).collect()
}

/// The state a time `width` later.
fn moved(input: Bodies<'_>, state: &Values, width: f64, parts: usize) -> Values {
    let step = width / parts as f64;
    (0..parts).fold(state.clone(), |state, _| {
        let mut table: Vec<Values> = Vec::new();
        for j in 0..COLUMNS {
            let count = 2 * (j + 1);
            let h = step / count as f64;
            let (mut before, mut now) = (state.clone(), plus(&state, &rates(input, &state), h));
            for _ in 1..count {
                let next = plus(&before, &rates(input, &now), 2.0 * h);
                (before, now) = (now, next);
            }
            let smooth: Values = {
                let last = plus(&now, &rates(input, &now), h);
                last.iter().zip(&before).map(|(a, b)| a.add(*b).times(0.5)).collect()
            };
            let last: Values = now.iter().zip(&smooth).map(|(a, b)| a.add(*b).times(0.5)).collect();
            let mut row = vec![last];
            for k in 0..j {
                let ratio = (j + 1) as f64 / (j - k) as f64;
                let divisor = Doubled::product(ratio, ratio).add((-1.0).into());
                let higher = row[k]
                    .iter()
                    .zip(&table[k])
                    .map(|(a, b)| a.add(a.add(b.times(-1.0)).over(divisor)));
                row.push(higher.collect());
            }
            table = row;
        }
        table.pop().unwrap_or(state)
    })
}

/// The same between two times; slip that has begun at time 0 by parts in proportion to the time since.
fn moved_from(input: Bodies<'_>, state: &Values, [from, to]: [f64; 2], parts: usize) -> Values {
    if from == 0.0 {
        return moved(input, state, to, parts);
    }
    let (mut state, mut time) = (state.clone(), from);
    while time < to {
        let next = (GROWS * time).min(to);
        state = moved(input, &state, next - time, parts);
        time = next;
    }
    state
}

/// Bodies in a row, under given normal forces or pressed along dofs of their own.
fn input(bodies: usize, numbers: &[f64], [general, equal, pressed]: [bool; 3]) -> SceneInput {
    let number = |place: usize| numbers[place % numbers.len()];
    let plane = 2 * bodies;
    let size = if pressed { 3 * bodies } else { plane };
    let entry = |i: usize, j: usize| match i.abs_diff(j) {
        0 => 100.0 * (1.5 + number(i)),
        1 => 30.0 * number(3 + i + j),
        _ if i.max(j) >= plane && i.min(j) < plane => 20.0 * number(5 + i + j),
        _ => 0.0,
    };
    let stiffness = SparseMatrix::from_dense(&DMatrix::from_fn(size, size, entry));
    let contact = |i: usize| ContactInput {
        tangential: Some(Direction::Dof(i)),
        normal: (pressed && i.is_multiple_of(2)).then_some(Direction::Dof(plane + i / 2)),
        normal_force: if pressed { 0.0 } else { 1.0 + 5.0 * number(i / 2 + 2).abs() },
        friction: 0.5 + 0.3 * number(i / 2 + 7),
        static_friction: 0.9,
        slider_speed: 0.3 * number(i + 4),
        beside: Some(i ^ 1),
        ..Default::default()
    };
    let mass = |i: usize| 1.0 + number(if equal { i / 2 } else { i } + 5).abs();
    SceneInput {
        mass: Mass::Lumped((0..size).map(mass).collect()),
        damping: match general {
            true => Damping::General(stiffness.scaled(0.002)),
            false => Damping::Proportional { mass: 0.1, stiffness: 1e-3 },
        },
        stiffness,
        force: (0..size).map(|i| number(i) - if i < plane { 0.0 } else { 6.0 }).collect(),
        contacts: (0..plane).map(contact).collect(),
        ..Default::default()
    }
}

static MET: AtomicUsize = AtomicUsize::new(0);
static BEGINNING: AtomicUsize = AtomicUsize::new(0);
static LOOSE: AtomicUsize = AtomicUsize::new(0);
static SLOW: AtomicUsize = AtomicUsize::new(0);
static FOLLOWING: AtomicUsize = AtomicUsize::new(0);
static BY_LAW: AtomicUsize = AtomicUsize::new(0);
static BESIDE: AtomicUsize = AtomicUsize::new(0);

/// Whether friction in a plane may follow a law.
fn is_of_planes(law: &FrictionLaw) -> bool {
    law.value(0.0) > 0.0
}

/// Zeros leave slip straight, and directions that neighbours alone turn.
fn number() -> impl Strategy<Value = f64> + Clone {
    prop_oneof![2 => -1.0..1.0f64, 1 => Just(0.0)]
}

/// A scene whose bodies all slip in planes, the first one from rest where its slip begins, and the state from which it goes on.
#[derive(Debug)]
struct Slipping {
    input: SceneInput,
    laws: Vec<Option<FrictionLaw>>,
    springs: Vec<Element>,
    scene: Scene,
    x: Vec<f64>,
    v: Vec<f64>,
    begins: usize,
}

impl Slipping {
    fn basis(&self) -> CombinationBasis {
        let plane = self.input.contacts.len();
        let combination = Combination::parse(&"o".repeat(plane), plane).expect("letters");
        CombinationBasis::new(&self.scene, &combination, Wanted::Series).expect("a basis")
    }
}

/// Scenes of these numbers.
fn slipping(number: impl Strategy<Value = f64> + Clone) -> impl Strategy<Value = Slipping> {
    let drawn = (
        proptest::collection::vec(number.clone(), 11),
        proptest::collection::vec(number, 7),
        1..4usize,
        any::<[bool; 3]>(),
        -9.0..0.0f64,
        0..6usize,
        proptest::collection::vec(proptest::option::of(law()), 3),
        proptest::collection::vec(element(), 0..=2),
    );
    drawn.prop_filter_map("no such slip", |drawn| {
        let (numbers, start, bodies, kind, power, begins, laws, elements) = drawn;
        let mut input = input(bodies, &numbers, kind);
        let laws: Vec<Option<FrictionLaw>> =
            laws.into_iter().take(bodies).map(|law| law.filter(is_of_planes)).collect();
        for (i, contact) in input.contacts.iter_mut().enumerate() {
            let Some(law) = &laws[i / 2] else { continue };
            contact.friction = law.value(0.0);
            contact.static_friction = contact.static_friction.max(contact.friction);
        }
        BY_LAW.fetch_add(usize::from(laws.iter().any(Option::is_some)), Ordering::Relaxed);
        let (size, plane) = (input.force.len(), input.contacts.len());
        let beside = Scene::new(input.clone()).expect("well-posed").with_elements(&elements);
        let beside = beside.ok()?;
        let springs = beside.elements().to_vec();
        BESIDE.fetch_add(usize::from(!springs.is_empty()), Ordering::Relaxed);
        let (mut x, mut v) = (vec![0.0; size], vec![0.0; size]);
        for i in 0..plane {
            x[i] = 0.02 * start[i % 7];
            let slip = if i < 2 { 10f64.powf(power) } else { 0.4 } * start[(i + 3) % 7];
            v[i] = input.contacts[i].slider_speed + if begins < 2 && i < 2 { 0.0 } else { slip };
        }
        if begins < 2 {
            // Forces on the contact above its limit; or at it, along a direction in which they grow.
            let [_, _, stiffness, ..] = input.matrices();
            let state: Values = x.iter().chain(&v).map(|&of| Doubled::from(of)).collect();
            let bodies = (&input, &laws[..], &springs[..]);
            let begun = loads(bodies, &state);
            let pressed = match input.contacts[0].normal {
                Some(_) => -begun[plane].value(),
                None => input.contacts[0].normal_force,
            };
            if !(pressed > LIFTS) {
                return None;
            }
            let limit = input.contacts[0].friction * pressed;
            let pulls: [f64; 2] = [0, 1].map(|i| -stiffness.row_dot(i, &v));
            let length = pulls[0].hypot(pulls[1]).max(1e-3);
            let angle = 0.8 * start[5];
            let turned = [
                pulls[0] * angle.cos() - pulls[1] * angle.sin(),
                pulls[0] * angle.sin() + pulls[1] * angle.cos(),
            ];
            // Slip begins where the forces grow faster than the limit, which a normal force may raise.
            let mut change = rates(bodies, &state);
            (0..size)
                .filter(|i| !(2..plane).contains(i))
                .for_each(|i| change[size + i] = 0.0.into());
            let [late, early] =
                [STEP, -STEP].map(|step| loads(bodies, &plus(&state, &change, step)));
            let rate = |row: usize| -(late[row].value() - early[row].value()) / (2.0 * STEP);
            let raised = match input.contacts[0].normal {
                Some(_) => input.contacts[0].friction * rate(plane),
                None => 0.0,
            };
            let grows = -(turned[0] * rate(0) + turned[1] * rate(1)) / length;
            if !(begins == 0 || grows > raised + 1e-6) {
                return None;
            }
            let size = if begins == 0 { limit * (1.1 + start[6].abs()) } else { limit };
            for i in 0..2 {
                input.force[i] += size * turned[i] / length - begun[i].value();
            }
        }
        let of_contacts = laws.iter().flat_map(|law| [law.clone(), law.clone()]).collect();
        let scene = Scene::new(input.clone()).expect("well-posed");
        let scene = scene.with_friction_laws(of_contacts).expect("laws of planes");
        let scene = scene.with_elements(&elements).expect("as before");
        Some(Slipping { input, laws, springs, scene, x, v, begins })
    })
}

/// `make fuzz-panels N=4000` draws more than 10 000 of them.
#[test]
fn bounds_in_planes_are_never_below_true_errors() {
    panels_in_planes();
    let [panels, loose, beginning, slow, by_law, beside] =
        [&MET, &LOOSE, &BEGINNING, &SLOW, &BY_LAW, &BESIDE]
            .map(|count| count.load(Ordering::Relaxed));
    println!(
        "{panels} panels, {beginning} from rest, {slow} slower than 1e-4 m/s, {by_law} motions by laws, {beside} beside springs and dampers"
    );
    let rarest = [beginning, slow, by_law, beside].into_iter().min();
    assert!(panels > 5 * beginning && rarest > Some(0));
    assert!(20 * loose < panels, "{loose} loose bounds");
}

#[test]
fn neighbours_in_planes_follow_as_they_are_carried() {
    for _ in 0..DRAWN {
        neighbours_in_planes();
        if FOLLOWING.load(Ordering::Relaxed) > 0 {
            break;
        }
    }
    let following = FOLLOWING.load(Ordering::Relaxed);
    println!("{following} motions with neighbours that follow");
    assert!(following > 0);
}

proptest! {
    fn panels_in_planes(
        slipping in slipping(-1.0..1.0f64),
        places in proptest::collection::vec(0.1..1.0f64, 2),
    ) {
        let basis = slipping.basis();
        let Propagator::Law(operator) = &basis.propagator else { panic!("not by its law") };
        let functions = &basis.functions;
        let Slipping { input, laws, springs, scene, x, v, begins } = &slipping;
        BY_LAW.fetch_add(usize::from(laws.iter().any(Option::is_some)), Ordering::Relaxed);
        BESIDE.fetch_add(usize::from(!springs.is_empty()), Ordering::Relaxed);
        let (mut q, mut u) = scene.moving_coordinates(x, v, 0.0);
        let mut motion = LawMotion::default();
        motion.restart(scene, operator, functions, &q, &u);
        let mut panel = Panel::default();
        let bodies = (input, &laws[..], &springs[..]);
        let speed = |u: &[f64]| operator.planes.iter().map(|one| one.speed(u)).fold(1.0, f64::min);
        'panels: for place in 0..PANELS {
            if !motion.stopped(operator).is_empty() || motion.exhausted().is_some() {
                break;
            }
            motion.expand(operator, functions, &mut panel);
            let width = panel.width;
            prop_assert!(motion.left_out.is_finite(), "no bound in panel {place}");
            if motion.ends_slip() {
                break;
            }
            MET.fetch_add(1, Ordering::Relaxed);
            let from = if place == 0 { *BEGUN.get(*begins).unwrap_or(&0.0) } else { 0.0 };
            BEGINNING.fetch_add(usize::from(from > 0.0), Ordering::Relaxed);
            motion.state(operator, from * width, &mut q, &mut u);
            let dofs = |q: &[f64], u: &[f64]| -> Vec<f64> {
                let (x, v) = scene.dof_state(q, u);
                x.into_iter().chain(v).collect()
            };
            SLOW.fetch_add(usize::from(speed(&u) < 1e-4), Ordering::Relaxed);
            let begun: Values = dofs(&q, &u).into_iter().map(Doubled::from).collect();
            for &to in places.iter().chain(&[1.0]) {
                let span = [from, to.max(from)].map(|part| part * width);
                motion.state(operator, span[1], &mut q, &mut u);
                if functions.iter().any(|function| function.functional.value(&q, &u) < LIFTS) {
                    break 'panels;
                }
                    let found = dofs(&q, &u);
                let largest = max_norm(&found);
                // No mass is below 1 kg.
                let bound = motion.left_out + ROUNDING * f64::EPSILON * largest;
                let error = |parts: usize| {
                    let known = moved_from(bodies, &begun, span, parts);
                    let errors = known.iter().zip(&found).map(|(a, &b)| a.add((-b).into()));
                    errors.map(|error| error.value().abs()).fold(0.0, f64::max)
                };
                let least = PARTS.iter().map(|&parts| error(parts)).find(|&error| error <= bound);
                prop_assert!(least.is_some(), "above {bound:e} at {to} of panel {place} from {from}");
                // A formula of huge numbers that cancel has their rounding.
                LOOSE.fetch_add(usize::from(bound > 1e-11 * (1.0 + largest)), Ordering::Relaxed);
            }
            motion.advance(scene, operator);
        }
    }

    fn neighbours_in_planes(slipping in slipping(number())) {
        let basis = slipping.basis();
        let Propagator::Law(operator) = &basis.propagator else { panic!("not by its law") };
        let functions = &basis.functions;
        let Slipping { scene, x, v, begins, .. } = &slipping;
        let (mut q, mut u) = scene.moving_coordinates(x, v, 0.0);
        let mut motion = LawMotion::default();
        motion.restart(scene, operator, functions, &q, &u);
        let speed = |u: &[f64]| operator.planes.iter().map(|one| one.speed(u)).fold(1.0, f64::min);
        let mut slowest = 1.0f64;
        for _ in 0..PANELS {
            let stops = motion.ends_slip() || !motion.stopped(operator).is_empty();
            if stops || motion.exhausted().is_some() {
                break;
            }
            for offset in [0.0, motion.end() - motion.start()] {
                motion.state(operator, offset, &mut q, &mut u);
                slowest = slowest.min(speed(&u));
            }
            motion.advance(scene, operator);
        }
        let lasts = motion.start();
        if lasts == 0.0 {
            return Ok(());
        }
        let (q, u) = scene.moving_coordinates(x, v, 0.0);
        let mut carried = |follows: bool| {
            motion.begin(scene, operator, functions, &q, &u);
            if !follows {
                motion.planes.iter_mut().for_each(|series| series.relaxed_at = f64::INFINITY);
            }
            motion.fill(scene, operator);
            let rates = operator.planes.iter().zip(&motion.planes);
            let fastest = rates.map(|(one, series)| series.relaxation(one)).fold(0.0, f64::max);
            if fastest.is_finite() && fastest * lasts > STIFFEST {
                return (Vec::new(), false);
            }
            let column = |k: usize| (0..2 * scene.size).map(|i| f64::from(u8::from(i == k))).collect();
            // A slip that begins does so in all of them, at rest.
            let rests = operator.planes[0].coordinates.map(|row| scene.size + row);
            let free = (0..2 * scene.size).filter(|k| *begins >= 2 || !rests.contains(k));
            let mut columns: Vec<Vec<f64>> = free.map(column).collect();
            motion.carry(scene, operator, lasts, &mut columns);
            (columns.concat(), motion.planes.iter().any(PlaneSeries::follows))
        };
        let ((found, follows), (known, _)) = (carried(true), carried(false));
        FOLLOWING.fetch_add(usize::from(follows), Ordering::Relaxed);
        let largest = max_norm(&known);
        let off = max_distance(&found, &known);
        // Velocities have rounding, beside which slip may be slow.
        let alike = ALIKE + ROUNDING * f64::EPSILON / slowest;
        prop_assert!(off <= alike * largest, "neighbours {off:e} of {largest:e} apart");
    }
}
