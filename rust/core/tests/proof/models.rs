//! The models that the tests share.

use std::sync::Arc;

use stickslip_core::cycles::attractors::{SearchLimits, settle};
use stickslip_core::linalg::SparseMatrix;
use stickslip_core::scene::{Damping, Link, Mass, Subsystem, chain};
use stickslip_core::{
    Attractor, Combination, ContactInput, Controls, Cycle, Direction, Method, Propagators, Scene,
    SceneInput, State, Trajectory, simulate,
};

/// A contact with tangential and normal dof, as hard as it comes: no friction, a slider at rest, no bounce, no gap.
pub fn contact(tangential: usize, normal: usize) -> ContactInput {
    ContactInput {
        tangential: Some(Direction::Dof(tangential)),
        normal: Some(Direction::Dof(normal)),
        friction: 0.0,
        static_friction: 0.0,
        slider_speed: 0.0,
        ..Default::default()
    }
}

/// A block of mass 1 kg on a spring of 1 N/m, pressed onto a belt by 1 N: its dofs are the displacement along the belt
/// and the gap, which nothing couples. `T = mu N` with N = 1 N while it touches.
pub fn block(law: ContactInput) -> SceneInput {
    SceneInput {
        mass: Mass::Lumped(vec![1.0, 1.0]),
        stiffness: SparseMatrix::diagonal(&[1.0, 1.0]),
        damping: Damping::Proportional { mass: 0.0, stiffness: 0.0 },
        force: vec![0.0, -1.0],
        contacts: vec![law],
        ..Default::default()
    }
}

/// The belt of the closed form: static friction 1 N, kinetic friction 0.5 N, speed 0.1 m/s.
pub fn belt() -> ContactInput {
    ContactInput { friction: 0.5, static_friction: 1.0, slider_speed: 0.1, ..contact(0, 1) }
}

/// The published model of two subsystems (Brunetti, Massi, D'Ambrogio and Berthier), with the stiffnesses of its
/// matrix.
pub fn two_subsystems(friction: f64, slider_speed: f64) -> SceneInput {
    let part = |mass, inclination, vertical_stiffness, horizontal_stiffness, ceiling_stiffness| {
        Subsystem {
            upper_mass: mass,
            contact_mass: mass,
            inclination,
            vertical_stiffness,
            horizontal_stiffness,
            ceiling_stiffness,
            preload_displacement: 1e-3,
            external_force: 0.0,
        }
    };
    let parts = [part(0.3, 0.3, 4.5e5, 3.0e5, 6.0e4), part(0.7, 0.75, 3.0e4, 2.4e6, 1.8e5)];
    let link = Link { horizontal_stiffness: 1.5e6, vertical_stiffness: 2.4e5 };
    let (mass, stiffness, force) = chain(&parts, &[link], 1.8e6);
    let law = |tangential| ContactInput {
        friction,
        static_friction: friction,
        slider_speed,
        ..contact(tangential, tangential + 1)
    };
    SceneInput {
        mass: Mass::Lumped(mass),
        stiffness,
        damping: Damping::Proportional { mass: 0.0, stiffness: 1e-4 },
        force,
        contacts: vec![law(2), law(6)],
        ..Default::default()
    }
}

pub fn propagators(input: SceneInput) -> Arc<Propagators> {
    Arc::new(Propagators::new(Arc::new(Scene::new(input).expect("a well-posed scene"))))
}

pub fn state(position: &[f64], velocity: &[f64], combination: &str) -> State {
    State {
        friction_force: Vec::new(),
        internal: Vec::new(),
        position: position.to_vec(),
        velocity: velocity.to_vec(),
        combination: Combination::parse(combination, combination.len()).expect("statuses"),
    }
}

pub fn run(
    propagators: &Arc<Propagators>,
    start: &State,
    duration: f64,
    method: Method,
) -> Trajectory {
    simulate(propagators, start, duration, method, Controls::default()).expect("a run")
}

/// The cycle that a motion settles to, looked for after `stretch` s at first.
pub fn cycle(propagators: &Arc<Propagators>, start: &State, stretch: f64, method: Method) -> Cycle {
    let search =
        SearchLimits { stretch, limit: 40.0 * stretch, method, cancel: None, deadline: None };
    match settle(propagators, start, search).expect("a well-posed start") {
        (Attractor::Cycle(found), _) => found.cycle,
        (other, _) => panic!("no cycle but {other:?}"),
    }
}
