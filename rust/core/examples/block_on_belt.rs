//! A block on a belt, stuck until its spring pulls with the static friction of 1 N.

use std::sync::Arc;
use stickslip_core::linalg::SparseMatrix;
use stickslip_core::scene::{Damping, Mass};
use stickslip_core::*;

pub fn main() -> Result<(), Error> {
    let belt = ContactInput {
        tangential: Some(Direction::Dof(0)),
        normal: Some(Direction::Dof(1)),
        friction: 0.5,
        static_friction: 1.0,
        slider_speed: 0.1,
        ..Default::default()
    };
    let scene = Scene::new(SceneInput {
        mass: Mass::Lumped(vec![1.0, 1.0]),
        stiffness: SparseMatrix::diagonal(&[1.0, 1.0]),
        damping: Damping::Proportional { mass: 0.0, stiffness: 0.0 },
        force: vec![0.0, -1.0],
        contacts: vec![belt],
        ..Default::default()
    })?;
    let start = State {
        position: vec![0.0, 0.0],
        velocity: vec![0.1, 0.0],
        combination: Combination::parse("s", 1)?,
        friction_force: Vec::new(),
        internal: Vec::new(),
    };
    let propagators = Arc::new(Propagators::new(Arc::new(scene)));
    let run = simulate(&propagators, &start, 40.0, Method::Auto, Controls::default())?;
    assert_eq!(run.stop_reason, StopReason::Duration);
    // It slips after 1 N / (1 N/m * 0.1 m/s) = 10 s, and sticks again 3.5 s later.
    let times: Vec<f64> = run.events.iter().map(|event| event.time).collect();
    assert!((times[0] - 10.0).abs() < 1e-12 && (times[1] - 13.5363837732896).abs() < 1e-12);
    Ok(())
}
