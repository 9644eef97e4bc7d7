//! True errors of panels of linear phases, by the same motion in doubled precision on a fourth of the width, beside their
//! bounds.

use std::cell::RefCell;
use std::sync::Arc;

use nalgebra::DMatrix;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};

use crate::contact::event_function::{EventFunction, event_functions};
use crate::linalg::sparse::SparseMatrix;
use crate::motion::combination_basis::{CombinationBasis, Propagator};
use crate::motion::local::field::Field;
use crate::motion::local::locality::Locality;
use crate::motion::local::reach::Reaches;
use crate::motion::method::Wanted;
use crate::motion::panel::Panel;
use crate::motion::taylor::motion::TaylorMotion;
use crate::numerics::double_double::Doubled;
use crate::numerics::first_root::polynomial::{COEFFICIENTS, ROW};
use crate::scene::contact_law::{ContactInput, Direction};
use crate::scene::input::scene_input::{Damping, Mass, SceneInput};
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};

/// Steps and terms of the reference: its rest is below 1e-28 of the motion.
const STEPS: usize = 4;
const TERMS: usize = 28;
/// Masses that pull at the mass of a contact so that their forces cancel.
const PULLING: usize = 3;
/// The layouts of rows, and the numbers of coordinates that lead to them.
const LAYOUTS: [(Layout, usize); 7] = [
    (Layout::Dense, 7),
    (Layout::Dense, 12),
    (Layout::Dense, 30),
    (Layout::Chain, 64),
    (Layout::Border, 40),
    (Layout::CoupledMass, 9),
    (Layout::Local, 24),
];

#[derive(Debug, Clone, Copy, PartialEq)]
enum Layout {
    Dense,
    /// Sparse rows.
    Chain,
    /// Coordinates that only contacts couple.
    Border,
    CoupledMass,
    /// Local marches over sparse rows.
    Local,
}

/// Solves `matrix x = right` by elimination in doubled precision.
fn solve(matrix: &[Vec<Doubled>], mut right: Vec<Doubled>) -> Vec<Doubled> {
    let mut rows = matrix.to_vec();
    let n = right.len();
    for k in 0..n {
        for i in k + 1..n {
            let factor = rows[i][k].over(rows[k][k]).times(-1.0);
            for j in k..n {
                rows[i][j] = rows[i][j].add(factor.by(rows[k][j]));
            }
            right[i] = right[i].add(factor.by(right[k]));
        }
    }
    for i in (0..n).rev() {
        let rest = (i + 1..n).fold(right[i], |sum, j| sum.add(rows[i][j].by(right[j]).times(-1.0)));
        right[i] = rest.over(rows[i][i]);
    }
    right
}

/// (q, q') a time `width` later.
fn moved(scene: &Scene, statuses: &[Status], state: &mut [Vec<Doubled>; 2], width: f64) {
    let held = |k: usize| {
        scene.contacts.iter().zip(statuses).any(|(contact, status)| {
            k == contact.normal && status.is_closed()
                || k == contact.tangential && *status == Status::Sticking
        })
    };
    let free: Vec<usize> = (0..scene.size).filter(|&k| !held(k)).collect();
    // Friction moves rows of M as well.
    let merged = |row: usize| -> Vec<(usize, f64)> {
        let sliding = scene.contacts.iter().zip(statuses).filter(|(contact, status)| {
            contact.tangential == row && **status != Status::Sticking && status.is_closed()
        });
        let normals = sliding
            .map(|(contact, status)| (contact.normal, -status.friction_sign() * contact.friction));
        std::iter::once((row, 1.0)).chain(normals).collect()
    };
    let sum =
        |terms: &mut dyn Iterator<Item = Doubled>| terms.fold(Doubled::default(), Doubled::add);
    let mass = |row: usize, k: usize| {
        sum(&mut merged(row)
            .iter()
            .map(|&(j, factor)| Doubled::product(factor, scene.mass.get(j, k))))
    };
    let matrix: Vec<Vec<Doubled>> =
        free.iter().map(|&row| free.iter().map(|&k| mass(row, k)).collect()).collect();
    for _ in 0..STEPS {
        let mut q: Vec<Vec<Doubled>> = vec![state[0].clone()];
        let mut u: Vec<Vec<Doubled>> = vec![state[1].clone()];
        for k in 0..TERMS {
            let residual = |row: usize| {
                let load = Doubled::from(if k == 0 { scene.force[row] } else { 0.0 });
                let springs = scene.stiffness.row(row).map(|(j, value)| q[k][j].times(-value));
                let dampers = scene.damping.row(row).map(|(j, value)| u[k][j].times(-value));
                springs.chain(dampers).fold(load, Doubled::add)
            };
            let force = |row: &usize| {
                sum(&mut merged(*row).iter().map(|&(j, factor)| residual(j).times(factor)))
            };
            let right: Vec<Doubled> = free.iter().map(force).collect();
            let acceleration = match scene.mass.is_diagonal() {
                true => right.iter().enumerate().map(|(i, r)| r.over(matrix[i][i])).collect(),
                false => solve(&matrix, right),
            };
            let order = Doubled::from((k + 1) as f64);
            let mut next = vec![Doubled::default(); scene.size];
            free.iter().zip(acceleration).for_each(|(&row, a)| next[row] = a.over(order));
            q.push(u[k].iter().map(|v| v.over(order)).collect());
            u.push(next);
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

/// Two contacts: along dofs 0 and 2, across dofs 1 and 3. Where pulls cancel, the last masses have equal springs to dof 1, and
/// no others act on it.
fn scene(layout: Layout, size: usize, numbers: &[f64], damping: usize, cancels: bool) -> Scene {
    let number = |place: usize| numbers[place % numbers.len()];
    let pulls = |i: usize| cancels && i >= size - PULLING;
    let near = match layout {
        Layout::Chain | Layout::Local => 4,
        _ => size,
    };
    let entry = |i: usize, j: usize| {
        let (low, high) = (i.min(j), i.max(j));
        match high - low {
            0 => 100.0 * (2.0 + number(i)),
            _ if cancels && low == 1 && pulls(high) => -32.0,
            _ if cancels && (low == 1 || high == 1) => 0.0,
            _ if pulls(high) => 0.0,
            _ if layout == Layout::Border && low > 3 => 0.0,
            off if off < near => 120.0 / near as f64 * number(3 + i + j + i * j),
            _ => 0.0,
        }
    };
    let heavy = |i: usize| if cancels && pulls(i) { 1.0 } else { 10f64.powf(number(i + 5)) };
    let mass = match layout {
        Layout::CoupledMass => Mass::Full(DMatrix::from_fn(size, size, |i, j| {
            let share = if i == j { 1.0 } else { 0.3 / size as f64 * number(1 + i + j) };
            let apart = cancels && i != j && (i.min(j) <= 1 || pulls(i.max(j)));
            if apart { 0.0 } else { share * (heavy(i) * heavy(j)).sqrt() }
        })),
        _ => Mass::Lumped((0..size).map(heavy).collect()),
    };
    let share = 1e-3 * number(7).abs();
    let drag = |i: usize, j: usize| match i.abs_diff(j) {
        0 => 100.0 * share * (1.0 + (i % 3) as f64),
        1 if i.min(j) > 1 && !pulls(i.max(j)) => -30.0 * share,
        _ => 0.0,
    };
    let damping = match damping {
        0 => Damping::Proportional { mass: 0.0, stiffness: share },
        1 => Damping::Proportional { mass: 50.0 * share, stiffness: share },
        _ => Damping::General(SparseMatrix::from_dense(&DMatrix::from_fn(size, size, drag))),
    };
    let contact = |i: usize| ContactInput {
        tangential: Some(Direction::Dof(2 * i)),
        normal: Some(Direction::Dof(2 * i + 1)),
        friction: 0.3,
        static_friction: 0.4,
        slider_speed: 0.5,
        restitution: 0.5,
        ..Default::default()
    };
    let force = |i: usize| if cancels && i % 2 == 1 || pulls(i) { 0.0 } else { 10.0 * number(i) };
    Scene::new(SceneInput {
        mass,
        stiffness: SparseMatrix::from_dense(&DMatrix::from_fn(size, size, entry)),
        damping,
        force: (0..size).map(force).collect(),
        contacts: (0..2).map(contact).collect(),
        ..Default::default()
    })
    .expect("well-posed")
}

/// What a layout has shown.
#[derive(Default)]
struct Seen {
    panels: usize,
    /// Error over bound.
    largest: f64,
}

impl Seen {
    /// The errors of the functions of a panel at some of its places, from the state at its start.
    fn compare(
        &mut self,
        scene: &Scene,
        statuses: &[Status],
        functions: &[EventFunction],
        panel: &Panel,
        start: &[Vec<Doubled>; 2],
        places: &[f64],
    ) -> Result<(), TestCaseError> {
        for &place in places.iter().chain(&[1.0]) {
            let mut state = start.clone();
            moved(scene, statuses, &mut state, place * panel.width);
            for (index, function) in functions.iter().enumerate() {
                let terms = |terms: &[(usize, f64)], x: &[Doubled]| {
                    terms.iter().fold(Doubled::default(), |sum, &(k, w)| sum.add(x[k].times(w)))
                };
                let functional = &function.functional;
                let expected = terms(&functional.position, &state[0])
                    .add(terms(&functional.velocity, &state[1]))
                    .add(functional.constant.into());
                if panel.excluded[index] {
                    prop_assert!(expected.value() > 0.0, "{:?}: {expected:?}", function.trigger);
                    continue;
                }
                let row = &panel.coefficients[index * ROW..];
                let horner = |value: Doubled, &c: &f64| value.times(place).add(c.into());
                let found = row[..COEFFICIENTS].iter().rev().fold(Doubled::default(), horner);
                let error = found.add(expected.times(-1.0)).value().abs();
                let bound = panel.error[index];
                self.largest = self.largest.max(error / bound);
                prop_assert!(
                    error <= bound,
                    "{:?}: {error:e} above {bound:e} at {place}",
                    function.trigger
                );
                // A bound that says nothing is none.
                prop_assert!(bound < 1e-8, "{bound:e}");
            }
        }
        Ok(())
    }

    /// Compares the first panels of a phase.
    fn panels_of(
        &mut self,
        layout: Layout,
        whole: Scene,
        start: &[f64],
        statuses: &[usize],
        cancels: bool,
        places: &[f64],
    ) -> Result<(), TestCaseError> {
        let size = whole.size;
        let all = [Status::Positive, Status::Negative, Status::Sticking, Status::Detached];
        let mut statuses: Vec<Status> = statuses.iter().map(|&s| all[s]).collect();
        if cancels {
            statuses[0] = Status::Detached;
        }
        let mut state = [0, 3].map(|first| -> Vec<f64> {
            (0..size).map(|i| 0.3f64.powi(first) * start[(first as usize + i) % 7]).collect()
        });
        for (i, status) in statuses.iter().enumerate() {
            if status.is_closed() {
                (state[0][2 * i + 1], state[1][2 * i + 1]) = (0.0, 0.0);
            }
            if *status == Status::Sticking {
                state[1][2 * i] = 0.5;
            }
        }
        if cancels {
            // Of so few digits that the sum is zero.
            let few = |x: f64| (x * 1024.0).round() / 1024.0;
            for half in &mut state {
                let pulling = &mut half[size - PULLING..];
                pulling[..2].iter_mut().for_each(|x| *x = few(*x));
                pulling[2] = -pulling[0] - pulling[1];
                half[1] = 0.0;
            }
        }
        let [q, u] = &state;
        let combination = Combination::new(statuses.clone());
        let doubled = |x: &[f64]| x.iter().map(|&x| Doubled::from(x)).collect::<Vec<_>>();
        let mut panel = Panel::default();
        if layout == Layout::Local {
            let whole = Arc::new(whole);
            let functions = event_functions(&whole, &combination).expect("functions");
            let mut field =
                Field::new(&whole, &Arc::new(Reaches::new(Locality::new(&whole).expect("local"))));
            field.begin(&statuses, q, u);
            field.functions(&functions, &mut panel);
            self.panels += 1;
            return self.compare(
                &whole,
                &statuses,
                &functions,
                &panel,
                &[doubled(q), doubled(u)],
                places,
            );
        }
        let basis = CombinationBasis::new(&whole, &combination, Wanted::Series).expect("a basis");
        let Propagator::Taylor(operator) = &basis.propagator else { panic!("not by series") };
        let (functions, scene) = (&basis.functions, basis.scene(&whole));
        let mut motion = TaylorMotion::default();
        motion.restart(scene, operator, functions, q, u);
        for _ in 0..3 {
            motion.expand(scene, operator, functions, &mut panel);
            self.panels += 1;
            let [places_now, rates] = motion.orders(0);
            let at = |(a, b): (&f64, &f64)| Doubled::from(*a).add((*b).into());
            let width = Doubled::from(motion.end() - motion.start());
            let from = [
                motion.origin.iter().zip(places_now).map(at).collect(),
                rates.iter().map(|&rate| Doubled::from(rate).over(width)).collect(),
            ];
            self.compare(scene, &statuses, functions, &panel, &from, places)?;
            motion.advance(scene, operator);
        }
        Ok(())
    }
}

/// `make fuzz-panels N=100000` draws as many scenes of them.
#[test]
fn linear_panels_are_within_their_bounds() {
    let Config { cases, .. } = Config::default();
    for (layout, size) in LAYOUTS {
        let seen = RefCell::new(Seen::default());
        let cases = cases.div_ceil(LAYOUTS.len() as u32);
        let drawn = (
            proptest::collection::vec(-1.0..1.0f64, 11),
            proptest::collection::vec(-1.0..1.0f64, 7),
            0..3usize,
            proptest::collection::vec(0usize..4, 2),
            any::<bool>(),
            proptest::collection::vec(0.0..1.0f64, 2),
        );
        TestRunner::new(Config { cases, source_file: Some(file!()), ..Config::default() })
            .run(&drawn, |(numbers, start, damping, statuses, cancels, places)| {
                let whole = scene(layout, size, &numbers, damping, cancels);
                seen.borrow_mut().panels_of(layout, whole, &start, &statuses, cancels, &places)
            })
            .unwrap_or_else(|error| panic!("{layout:?}: {error}"));
        let Seen { panels, largest } = seen.into_inner();
        println!(
            "{panels} panels of {layout:?}, {size}: an error is at most {largest:.1e} of its bound"
        );
    }
}
