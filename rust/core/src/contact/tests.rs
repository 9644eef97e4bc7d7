//! Transitions against the contact problem, and impacts against the laws that they obey.

use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

use crate::contact::event_kind::EventKind;
use crate::contact::problem::conditions::{Case, Conditions};
use crate::contact::problem::contact_problem::ContactProblem;
use crate::contact::settlement::{Departure, Series, Settlement};
use crate::contact::transition::{impact, settle};
use crate::error::run::Level;
use crate::linalg::sparse::SparseMatrix;
use crate::scene::contact_law::{ContactInput, Direction};
use crate::scene::input::scene_input::{Damping, Mass, SceneInput};
use crate::scene::model::Scene;
use crate::scene::status::{Combination, Status};

/// Contacts of which contact i has the dofs 2 i (tangential) and 2 i + 1 (normal).
fn scene(mass: Mass, stiffness: &DMatrix<f64>, force: &[f64], slider_speed: f64) -> Scene {
    let contact = |i: usize| ContactInput {
        tangential: Some(Direction::Dof(2 * i)),
        normal: Some(Direction::Dof(2 * i + 1)),
        friction: 0.3,
        static_friction: 0.3,
        slider_speed,
        ..Default::default()
    };
    let input = SceneInput {
        mass,
        stiffness: SparseMatrix::from_dense(stiffness),
        damping: Damping::Proportional { mass: 0.1, stiffness: 0.0 },
        force: force.to_vec(),
        contacts: (0..force.len() / 2).map(contact).collect(),
        impact_friction: true,
        ..Default::default()
    };
    Scene::new(input).expect("a well-posed scene")
}

/// `A A' + 1`, from numbers in [-1, 1].
fn definite(size: usize, numbers: &[f64]) -> DMatrix<f64> {
    let a = DMatrix::from_fn(size, size, |i, j| numbers[(i * size + j) % numbers.len()]);
    &a * a.transpose() + DMatrix::identity(size, size)
}

proptest! {
    /// The end of a slide: the status of a contact that mass couples to none is that of the problem of its two accelerations.
    #[test]
    fn the_end_of_a_slide_solves_the_contact_problem(
        numbers in proptest::collection::vec(-1.0..1.0f64, 12),
        pressed in 0.0..3.0f64,
        before in proptest::sample::select(vec![Status::Positive, Status::Negative]),
    ) {
        let masses = [1.5, 0.5];
        let force = [2.0 * numbers[4], 1.0 - pressed];
        let scene = scene(Mass::Lumped(masses.to_vec()), &definite(2, &numbers), &force, 1.0);
        let (mut q, mut u) = (vec![numbers[5], 0.0], vec![1.0, 0.0]);
        let reactions = [0, 1].map(|row| scene.reaction_value(row, &q, &u));
        let a0: Vec<f64> = reactions.iter().zip(masses).map(|(r, m)| -r / m).collect();
        let w = DMatrix::from_diagonal(&DVector::from_iterator(2, masses.map(f64::recip)));
        let conditions =
            Conditions { case: Case::Resting, friction: 0.3, static_friction: 0.3, opens: true };
        let problem = ContactProblem::new(vec![conditions], Level::Accelerations, w, a0);
        let expected = problem.solve().expect("one motion").statuses[0];
        let mut settlement = Settlement {
            statuses: vec![before],
            departures: vec![Departure::None],
            events: Vec::new(),
            rest: None,
        };
        let triggers = [(0, EventKind::Velocity)];
        let series = Series { gaps: vec![0.0], ratios: vec![0.0], ..Series::default() };
        settle(&scene, 0.0, &triggers, 0..1, &mut settlement, &series, &mut q, &mut u)
            .expect("one motion");
        prop_assert_eq!(settlement.statuses[0], expected);
    }

    /// An impact without restitution between contacts that mass couples: gaps do not approach, impulses press and stay within
    /// friction, and sliders at rest give no energy.
    #[test]
    fn impulses_press_and_dissipate(
        numbers in proptest::collection::vec(-1.0..1.0f64, 24),
        other in "[+sd-]",
    ) {
        let mass = definite(4, &numbers);
        let stiffness = DMatrix::identity(4, 4);
        let scene = scene(Mass::Full(mass.clone()), &stiffness, &[0.0; 4], 0.0);
        prop_assert!(scene.contacts_coupled());
        let is_open = other == "d";
        let velocity = [
            numbers[16],
            -0.1 - numbers[17].abs(),
            if other == "s" { 0.0 } else { numbers[18] },
            if is_open { numbers[19].abs() } else { 0.0 },
        ];
        let place = [0.0, 0.0, 0.0, if is_open { 1.0 } else { 0.0 }];
        let (q, mut u) = scene.to_coordinates(&place, &velocity);
        let status = Combination::parse(&other, 1).expect("a status");
        let statuses = [Status::Detached, status.statuses()[0]];
        impact(&scene, &statuses, &[0], &q, &mut u).expect("one motion");
        let after = DVector::from_vec(scene.velocities(&u));
        let before = DVector::from_row_slice(&velocity);
        let impulses = &mass * (&after - &before);
        let rounding = 1e-12 * mass.amax() * before.amax();
        for contact in 0..2 {
            let [friction, normal] = [impulses[2 * contact], impulses[2 * contact + 1]];
            if contact == 1 && is_open {
                prop_assert!(friction.abs().max(normal.abs()) <= rounding);
                continue;
            }
            prop_assert!(after[2 * contact + 1] >= -rounding && normal >= -rounding);
            prop_assert!(friction.abs() <= 0.3 * normal + rounding);
            prop_assert!(friction * after[2 * contact] <= rounding);
        }
        let energy = |v: &DVector<f64>| 0.5 * v.dot(&(&mass * v));
        prop_assert!(energy(&after) <= energy(&before) + rounding);
    }
}
