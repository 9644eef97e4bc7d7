//! True errors of panels with springs in planes, by the equations in displacements and deflections in doubled precision.
//!
//! The reference has the deflections z as states of first order, and nothing of the hidden coordinates by which the series carry them.

use std::sync::atomic::{AtomicUsize, Ordering};

use proptest::prelude::*;

use crate::contact::admissible_start::{forces_of_state, start_coordinates};
use crate::contact::functional::Functional;
use crate::motion::combination_basis::{CombinationBasis, Propagator};
use crate::motion::friction::fuzz::state_errors::structure;
use crate::motion::friction::fuzz::true_errors::{STEPS, TERMS};
use crate::motion::friction::motion::LawMotion;
use crate::motion::method::Wanted;
use crate::motion::panel::Panel;
use crate::numerics::double_double::Doubled;
use crate::scene::contact_law::{ContactInput, Direction, Springs};
use crate::scene::input::scene_input::SceneInput;
use crate::scene::model::{Scene, State};
use crate::scene::status::{Combination, Status};

/// Panels of one motion.
const PANELS: usize = 60;
/// Times that a deflection relaxes in one step of the reference, at most.
const RELAXES: f64 = 0.25;
/// Units of rounding of a polynomial and of a sum of a few terms.
const ROUNDING: f64 = 8.0;
/// Angle of a friction force to the slip velocity at the start, rad, at most.
const ASIDE: f64 = 1.3;
/// Dofs of one contact: two in its plane, and its normal.
const DOFS: usize = 3;

/// Displacements and velocities of contact coordinates, and deflections of all contacts, by direction.
type Place = [Vec<Doubled>; 3];

/// The numbers of one contact: mu, k, the given normal force if there is one, and the velocity of the slider.
#[derive(Debug, Clone, Copy)]
struct Pad {
    friction: f64,
    stiffness: f64,
    given: Option<f64>,
    slider: [f64; 2],
}

fn pad() -> impl Strategy<Value = Pad> {
    let given = proptest::option::weighted(0.3, 1.0..6.0f64);
    (0.1..1.0f64, 1.0..4.0f64, given, -0.5..0.5f64, -0.5..0.5f64).prop_map(
        |(friction, power, given, x, y)| Pad {
            friction,
            stiffness: 10f64.powf(power),
            given,
            slider: [x, y],
        },
    )
}

/// `sum a_i b_{k-i}` of the last order of both.
fn product(a: &[Doubled], b: &[Doubled]) -> Doubled {
    a.iter().zip(b.iter().rev()).fold(Doubled::default(), |sum, (a, b)| sum.add(a.by(*b)))
}

/// The next order of `a / b`.
fn quotient(a: Doubled, b: &[Doubled], lower: &[Doubled]) -> Doubled {
    let known = lower.iter().zip(b[1..].iter().rev());
    known.fold(a, |rest, (q, b)| rest.add(q.by(*b).times(-1.0))).over(b[0])
}

/// The state a time `width` later: `z' = w - e (e . w - r')` with `e = k z / (mu N)` and `r = mu N / k`.
fn moved(scene: &Scene, pads: &[Pad], state: &mut Place, width: f64) {
    let held = |k: usize| scene.contacts.iter().any(|law| law.normal == k);
    let rate = |(i, pad): (usize, &Pad)| {
        let law = &scene.contacts[2 * i];
        let plane = law.plane.expect("a plane");
        let [x, y] = [law.tangential, plane.tangential].map(|t| state[1][t].value());
        let normal = pad.given.unwrap_or_else(|| {
            let [q, u] = [0, 1].map(|i| state[i].iter().map(|x| x.value()).collect::<Vec<f64>>());
            scene.reaction_value(law.normal, &q, &u)
        });
        pad.stiffness * (x - pad.slider[0]).hypot(y - pad.slider[1]) / (pad.friction * normal)
    };
    let fastest = pads.iter().enumerate().map(rate).fold(0.0, f64::max);
    let steps = (width * fastest / RELAXES).ceil().max(STEPS as f64);
    for _ in 0..steps as usize {
        let [mut x, mut v, mut z] = state.each_ref().map(|part| vec![part.clone()]);
        // By contact: N, N', w, z / N and (z . w) / N.
        let mut normals = vec![[Vec::new(), Vec::new()]; pads.len()];
        let mut slips = vec![[Vec::new(), Vec::new()]; pads.len()];
        let mut ratios = vec![[Vec::new(), Vec::new()]; pads.len()];
        let mut speeds = vec![Vec::new(); pads.len()];
        for k in 0..TERMS {
            let order = Doubled::from((k + 1) as f64);
            let constant = |value: f64| Doubled::from(if k == 0 { value } else { 0.0 });
            let of_row = |row: usize, x: &[Doubled], v: &[Doubled], load: Doubled| {
                let springs = scene.stiffness.row(row).map(|(j, value)| x[j].times(value));
                let felt = scene.damping.row(row).filter(|&(j, _)| !scene.is_hidden(j));
                let dampers = felt.map(|(j, value)| v[j].times(value));
                springs.chain(dampers).fold(load, Doubled::add)
            };
            let mut rates = vec![Doubled::default(); scene.size];
            for (row, rate) in rates.iter_mut().enumerate().filter(|&(row, _)| !held(row)) {
                if scene.is_hidden(row) {
                    continue;
                }
                let mut load = of_row(row, &x[k], &v[k], constant(-scene.force[row]));
                let acts = scene.contacts.iter().position(|law| law.tangential == row);
                if let Some(contact) = acts {
                    load = load.add(z[k][contact].times(pads[contact / 2].stiffness));
                }
                *rate = load.times(-1.0).over(scene.mass.get(row, row).into());
            }
            let mut bent = vec![Doubled::default(); 2 * pads.len()];
            for (i, pad) in pads.iter().enumerate() {
                let (law, c) = (&scene.contacts[2 * i], pad.friction / pad.stiffness);
                let [force, force_rate] = match pad.given {
                    Some(normal) => [constant(normal), Doubled::default()],
                    None => [
                        of_row(law.normal, &x[k], &v[k], constant(-scene.force[law.normal])),
                        of_row(law.normal, &v[k], &rates, Doubled::default()),
                    ],
                };
                normals[i][0].push(force);
                normals[i][1].push(force_rate);
                for d in 0..2 {
                    let t = scene.contacts[2 * i + d].tangential;
                    slips[i][d].push(v[k][t].add(constant(-pad.slider[d])));
                    let ratio = quotient(z[k][2 * i + d], &normals[i][0], &ratios[i][d]);
                    ratios[i][d].push(ratio);
                }
                let along = [0, 1].map(|d| product(&ratios[i][d], &slips[i][d]));
                let faster = normals[i][1][k].times(-c);
                speeds[i].push(along[0].add(along[1]).over(c.into()).add(faster));
                for d in 0..2 {
                    let lost = product(&ratios[i][d], &speeds[i]).over(c.into());
                    bent[2 * i + d] = slips[i][d][k].add(lost.times(-1.0));
                }
            }
            x.push(v[k].iter().map(|v| v.over(order)).collect());
            v.push(rates.iter().map(|rate| rate.over(order)).collect());
            z.push(bent.iter().map(|rate| rate.over(order)).collect());
        }
        let step = width / steps;
        for (sum, terms) in state.iter_mut().zip([&x, &v, &z]) {
            for (j, sum) in sum.iter_mut().enumerate() {
                let horner = |value: Doubled, term: &Vec<Doubled>| value.times(step).add(term[j]);
                *sum = terms.iter().rev().fold(Doubled::default(), horner);
            }
        }
    }
}

fn scene(pads: &[Pad], numbers: &[f64], general: bool) -> Scene {
    let size = DOFS * pads.len() + 1;
    let contact = |(i, pad): (usize, &Pad)| {
        [0, 1].map(|d| ContactInput {
            tangential: Some(Direction::Dof(DOFS * i + d)),
            normal: (d == 0 && pad.given.is_none()).then_some(Direction::Dof(DOFS * i + 2)),
            normal_force: pad.given.unwrap_or(0.0),
            friction: pad.friction,
            static_friction: pad.friction,
            slider_speed: pad.slider[d],
            springs: Springs { tangential: Some(pad.stiffness), normal: None },
            beside: Some(2 * i + 1 - d),
            ..Default::default()
        })
    };
    let structure = structure(size, numbers, general);
    let pressed =
        |(k, &load): (usize, &f64)| if k % DOFS == 2 { -1.0 - 6.0 * load.abs() } else { load };
    let input = SceneInput {
        force: structure.force.iter().enumerate().map(pressed).collect(),
        contacts: pads.iter().enumerate().flat_map(contact).collect(),
        ..structure
    };
    Scene::new(input).expect("well-posed")
}

static MET: AtomicUsize = AtomicUsize::new(0);
static COMPARED: AtomicUsize = AtomicUsize::new(0);
static CHANGING: AtomicUsize = AtomicUsize::new(0);
static LIFTED: AtomicUsize = AtomicUsize::new(0);

/// `make fuzz-panels N=4000` draws more than 10 000 of them.
#[test]
fn bounds_of_springs_in_planes_are_never_below_true_errors() {
    panels_within_their_bounds();
    let [panels, compared, changing, lifted] =
        [&MET, &COMPARED, &CHANGING, &LIFTED].map(|count| count.load(Ordering::Relaxed));
    println!(
        "{panels} panels, {changing} of them under a normal force that changes, {lifted} up to where it vanishes, \
         {compared} values compared"
    );
    assert!(compared > panels && changing > 0);
}

proptest! {
    fn panels_within_their_bounds(
        numbers in proptest::collection::vec(-1.0..1.0f64, 11),
        start in proptest::collection::vec(-1.0..1.0f64, 9),
        pads in proptest::collection::vec(pad(), 1..=2),
        general in any::<bool>(),
        place in 0.1..1.0f64,
    ) {
        let scene = scene(&pads, &numbers, general);
        let count = pads.len();
        let size = DOFS * count + 1;
        let combination = Combination::new(vec![Status::Slipping; 2 * count]);
        let rests = |k: usize| k % DOFS == 2 && k < DOFS * count && pads[k / DOFS].given.is_none();
        let of = |k: usize, part: f64| if rests(k) { 0.0 } else { part };
        let mut state = State {
            position: (0..size).map(|k| of(k, 0.02 * start[k % 9])).collect(),
            velocity: (0..size).map(|k| of(k, 0.6 * start[(k + 4) % 9])).collect(),
            combination: combination.clone(),
            friction_force: Vec::new(),
            internal: Vec::new(),
        };
        let Ok(forces) = forces_of_state(&scene, &state) else { return Ok(()) };
        let turned = |i: usize| {
            let (s, c) = (ASIDE * start[i]).sin_cos();
            let [x, y] = [forces[2 * i].1, forces[2 * i + 1].1];
            [c * x - s * y, s * x + c * y]
        };
        state.friction_force = (0..count).flat_map(turned).collect();
        let Ok((mut q, mut u)) = start_coordinates(&scene, &state) else { return Ok(()) };
        let basis = CombinationBasis::new(&scene, &combination, Wanted::Series).expect("a basis");
        let Propagator::Law(operator) = &basis.propagator else { panic!("not by its law") };
        let mut motion = LawMotion::default();
        motion.restart(&scene, operator, &basis.functions, &q, &u);
        let mut panel = Panel::default();
        for _ in 0..PANELS {
            motion.expand(operator, &basis.functions, &mut panel);
            prop_assert!(panel.is_bounded(), "{pads:?}");
            let fades = motion.contacts.iter().any(|one| one.fades);
            if fades {
                LIFTED.fetch_add(1, Ordering::Relaxed);
                break;
            }
            MET.fetch_add(1, Ordering::Relaxed);
            let changing = pads.iter().any(|pad| pad.given.is_none());
            CHANGING.fetch_add(usize::from(changing), Ordering::Relaxed);
            let doubled = |x: &[f64]| x.iter().map(|&x| Doubled::from(x)).collect();
            let own = |contact: usize| scene.state_of(contact).expect("a spring");
            let bent = (0..2 * count).map(|contact| {
                let own = own(contact);
                Doubled::from(u[own.coordinate]).over(own.scale.into())
            });
            let mut reference: Place = [doubled(&q), doubled(&u), bent.collect()];
            moved(&scene, &pads, &mut reference, place * panel.width);
            for contact in 0..2 * count {
                let own = own(contact);
                reference[1][own.coordinate] = reference[2][contact].times(own.scale);
            }
            let (mut at, mut rates) = (q.clone(), u.clone());
            motion.state(operator, place * panel.width, &mut at, &mut rates);
            let expected = |of: &Functional| {
                let terms = |terms: &[(usize, f64)], x: &[Doubled]| {
                    let all = terms.iter().map(|&(k, weight)| x[k].times(weight));
                    all.fold(Doubled::default(), Doubled::add)
                };
                let places = terms(&of.position, &reference[0]);
                places.add(terms(&of.velocity, &reference[1])).add(of.constant.into())
            };
            for one in &operator.contacts {
                let state = one.state.as_ref().map(|state| (&state.value, state.norm));
                let pairs = [(&one.slip, one.slip_norm), (&one.normal, one.normal_norm)];
                for (functional, norm) in pairs.into_iter().chain(state) {
                    let found = functional.value(&at, &rates);
                    let error = expected(functional).add((-found).into()).value().abs();
                    let rounding = ROUNDING * f64::EPSILON * functional.magnitude(&at, &rates);
                    let bound = norm * motion.left_out + rounding;
                    prop_assert!(error <= bound, "{error:e} above {bound:e} at {place} of {pads:?}");
                    COMPARED.fetch_add(1, Ordering::Relaxed);
                }
            }
            motion.state(operator, panel.width, &mut q, &mut u);
            motion.advance(&scene, operator);
        }
    }
}
