//! What holds for every scene, on random ones: contact laws and energy balance of runs, bi-orthogonality of modes.

use num_complex::Complex64;
use proptest::collection::vec;
use proptest::prelude::*;
use stickslip_core::energy::works;
use stickslip_core::linalg::{DMatrix, SparseMatrix};
use stickslip_core::scene::{Damping, FrictionLaw, Mass};
use stickslip_core::{
    Combination, ContactInput, Controls, Method, Modes, Scene, SceneInput, Status, simulate,
};

use crate::models::{block, contact, propagators, run, state};

/// A scene of two contacts and a free mass, with numbers of order one: dofs (0, 1) and (2, 3) are tangential and normal
/// of the contacts.
fn scenes() -> impl Strategy<Value = SceneInput> {
    let law = |first: usize| {
        (0.0..1.0, 1.0..1.6, -0.5..0.5, 0.0..0.8, 0.0..0.2).prop_map(
            move |(friction, drop, slider_speed, restitution, gap)| ContactInput {
                friction,
                static_friction: drop * friction,
                slider_speed,
                restitution,
                gap,
                ..contact(first, first + 1)
            },
        )
    };
    (
        vec(0.5..2.0, 5),
        vec(-1.0..1.0, 25),
        vec(-0.3..0.3, 25),
        any::<bool>(),
        vec(-2.0..-0.5, 2),
        law(0),
        law(2),
        any::<bool>(),
    )
        .prop_map(
            |(mass, springs, dampers, proportional, loads, first, second, impact_friction)| {
                // B'B is positive semidefinite.
                let square = |b: &[f64], diagonal: f64| {
                    let entry = |i: usize, j: usize| -> f64 {
                        let sum: f64 = (0..5).map(|k| b[5 * k + i] * b[5 * k + j]).sum();
                        if i == j { sum + diagonal } else { sum }
                    };
                    let matrix = DMatrix::from_fn(5, 5, |i, j| entry(i.min(j), i.max(j)));
                    SparseMatrix::from_dense(&matrix)
                };
                SceneInput {
                    mass: Mass::Lumped(mass),
                    stiffness: square(&springs, 1.0),
                    damping: match proportional {
                        true => Damping::Proportional { mass: 0.02, stiffness: 0.01 },
                        false => Damping::General(square(&dampers, 0.0)),
                    },
                    force: vec![0.0, loads[0], 0.0, loads[1], 0.3],
                    contacts: vec![first, second],
                    impact_friction,
                    ..Default::default()
                }
            },
        )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn runs_keep_the_contact_laws_and_the_energy(
        input in scenes(),
        velocity in vec(-1.0..1.0, 5),
        taylor in any::<bool>(),
    ) {
        let laws = input.contacts.clone();
        let scene = propagators(input);
        // Both contacts start open.
        let start = state(&[0.1, 0.3, -0.2, 0.2, 0.0], &velocity, "dd");
        let method = if taylor { Method::Taylor } else { Method::Auto };
        let controls = Controls { max_events: Some(300), ..Controls::default() };
        let trajectory = simulate(&scene, &start, 30.0, method, controls).expect("a run");
        let end = trajectory.end;
        let times: Vec<f64> = (0..=400).map(|k| (end * f64::from(k) / 400.0).min(end)).collect();
        let sample = trajectory.sample(&times).expect("within the run");
        // Displacements, velocities and forces are of order one. Modes of condition c lose c^2 roundings of the motion,
        // and beyond 300 series are used; a touch within rounding is told apart by its bound.
        let works = works(&trajectory, 0.0, end).expect("within the run");
        let mut combinations: Vec<&Combination> =
            works.phases.iter().map(|phase| &phase.combination).collect();
        combinations.sort_by_key(|combination| combination.to_string());
        combinations.dedup();
        let conditions = combinations.iter().flat_map(|combination| {
            Modes::new(scene.bare(), combination).expect("modes").condition
        });
        let condition = match method {
            Method::Taylor => 1.0,
            _ => conditions.fold(1.0, f64::max).min(300.0),
        };
        let accuracy = 1e-12f64.max(16.0 * condition * condition * f64::EPSILON);
        let rounding =
            trajectory.grazings.iter().map(|touch| touch.uncertainty).fold(accuracy, f64::max);
        for k in 0..times.len() {
            for (i, law) in laws.iter().enumerate() {
                let gap = sample.position[5 * k + 2 * i + 1] + law.gap;
                let slip = sample.velocity[5 * k + 2 * i] - law.slider_speed;
                let (normal, friction) =
                    (sample.normal_force[2 * k + i], sample.friction_force[2 * k + i]);
                let lawful = match sample.status[2 * k + i] {
                    Status::Detached => gap >= -rounding && normal == 0.0 && friction == 0.0,
                    Status::Sticking => {
                        let limit = law.static_friction * normal;
                        gap.abs() <= rounding
                            && slip.abs() <= rounding
                            && normal >= -rounding
                            && friction.abs() <= limit + rounding
                    }
                    // Without friction nothing tells slip in one direction from slip in the other.
                    sliding => {
                        let sign = sliding.friction_sign();
                        gap.abs() <= rounding
                            && (sign * slip <= rounding || law.friction == 0.0)
                            && normal >= -rounding
                            && (friction - sign * law.friction * normal).abs() <= rounding
                    }
                };
                prop_assert!(
                    lawful,
                    "contact {i} at {}: gap {gap}, slip {slip}, N {normal}, T {friction}", times[k]
                );
            }
        }
        let phases = works.phases.iter().flat_map(|phase| {
            let damping = phase.damping.iter().map(|work| -work);
            phase.contact.iter().copied().chain(damping).chain([phase.external])
        });
        let impacts = works
            .impacts
            .iter()
            .flat_map(|impact| [impact.slider, -impact.friction, -impact.normal]);
        let terms: Vec<f64> = phases.chain(impacts).collect();
        let balance = terms.iter().sum::<f64>() - works.kinetic - works.elastic;
        let size: f64 = terms.iter().map(|work| work.abs()).sum::<f64>() + 1.0;
        prop_assert!(balance.abs() <= accuracy * size, "{balance} of {size}");
        // What starts open closes by an impact.
        let is_open = sample.status.iter().all(|&status| status == Status::Detached);
        prop_assert!(is_open || !works.impacts.is_empty());
        // Dampers, friction and impacts only take.
        prop_assert!(works.phases.iter().all(|phase| phase.damping.iter().all(|&work| work >= 0.0)));
        for impact in &works.impacts {
            let least = impact.normal.min(impact.friction);
            prop_assert!(least >= -accuracy * size, "{impact:?}");
        }
        for phase in &works.phases {
            for (slider, contact) in phase.slider.iter().zip(&phase.contact) {
                prop_assert!(slider - contact >= -accuracy * size, "friction gives energy");
            }
        }
    }

    /// `L' A R = diag(a)` and `L' B R = diag(b)`, with the displacement parts of the vectors:
    /// `v_i' (C + (lambda_i + lambda_j) M) x_j` and `v_i' (K - lambda_i lambda_j M) x_j`.
    #[test]
    fn modes_are_biorthogonal(input in scenes(), letters in vec(0usize..4, 2)) {
        let scene = propagators(input);
        let statuses = [Status::Positive, Status::Negative, Status::Sticking, Status::Detached];
        let chosen = letters.iter().map(|&k| statuses[k]).collect();
        let combination = Combination::new(chosen);
        let modes = Modes::new(scene.bare(), &combination).expect("modes");
        let m = modes.reduced.size();
        let count = modes.eigenvalues.len();
        prop_assert_eq!(count, 2 * m);
        let form = |matrix: &DMatrix<f64>, v: &[Complex64], x: &[Complex64]| -> Complex64 {
            (0..m).map(|i| (0..m).map(|j| v[i] * matrix[(i, j)] * x[j]).sum::<Complex64>()).sum()
        };
        let column = |matrix: &[Complex64], k: usize| matrix[m * k..m * (k + 1)].to_vec();
        for i in 0..count {
            for j in 0..count {
                if modes.defective[i] || modes.defective[j] {
                    continue;
                }
                let (v, x) = (column(&modes.left, i), column(&modes.right, j));
                let (p, s) = (modes.eigenvalues[i], modes.eigenvalues[j]);
                let mass = form(&modes.reduced.mass, &v, &x);
                let a = form(&modes.reduced.damping, &v, &x) + (p + s) * mass;
                let b = form(&modes.reduced.stiffness, &v, &x) - p * s * mass;
                let (of_a, of_b) = if i == j {
                    (modes.a[i], modes.b[i])
                } else {
                    (Complex64::default(), Complex64::default())
                };
                // Largest entries of the vectors are 1 and those of the matrices of order ten; an eigenvector is known
                // to rounding times its condition.
                let rounding = 1e-13 * (1.0 + modes.condition[i] + modes.condition[j]);
                let size = 1.0 + p.norm() * s.norm();
                prop_assert!((a - of_a).norm() <= rounding * size, "a of {i}, {j}: {a}, {of_a}");
                prop_assert!((b - of_b).norm() <= rounding * size, "b of {i}, {j}: {b}, {of_b}");
            }
        }
    }
}

/// A law too few or too many is refused, not an index beyond the contacts.
#[test]
fn laws_of_friction_are_one_per_contact() {
    let law = FrictionLaw::Linear { at_rest: 0.5, slope: 0.1 };
    for count in 0..3 {
        let scene = Scene::new(block(contact(0, 1))).expect("well-posed");
        let laws = vec![Some(law.clone()); count];
        assert_eq!(scene.with_friction_laws(laws).is_ok(), count == 1);
    }
}

/// A block that falls on its belt takes `1/2 m v^2 (1 - e^2)` with it: from y = 1 at rest `y = 2 cos t - 1`, which meets
/// the belt with `v^2 = 3`.
#[test]
fn an_impact_takes_the_energy_of_its_restitution() {
    let scene = propagators(block(ContactInput { restitution: 0.5, ..contact(0, 1) }));
    let trajectory = run(&scene, &state(&[0.0, 1.0], &[0.0, 0.0], "d"), 1.2, Method::Auto);
    let works = works(&trajectory, 0.0, trajectory.end).expect("within the run");
    assert_eq!(works.impacts.len(), 1);
    let impact = &works.impacts[0];
    assert!((impact.normal - 0.5 * 3.0 * (1.0 - 0.25)).abs() <= 1e-14, "{impact:?}");
    assert_eq!((impact.friction, impact.slider), (0.0, 0.0));
}
