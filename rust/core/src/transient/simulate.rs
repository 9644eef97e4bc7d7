//! The event-driven run: phase, first event, settlement, next phase; part by part where nothing couples them.

use std::sync::Arc;

use crate::contact::admissible_start::coordinates_at;
use crate::error::Error;
use crate::motion::method::Method;
use crate::motion::method_cost::marches_locally;
use crate::motion::propagators::Propagators;
use crate::scene::contact_law::Directions;
use crate::scene::model::State;
use crate::transient::local::march;
use crate::transient::partitioned;
use crate::transient::run::Run;
use crate::transient::run_state::Controls;
use crate::transient::trajectory::Trajectory;

/// Runs from `start` at time 0 for `duration` seconds, or until a limit.
pub fn simulate(
    propagators: &Arc<Propagators>,
    start: &State,
    duration: f64,
    method: Method,
    controls: Controls<'_>,
) -> Result<Trajectory, Error> {
    if !(duration > 0.0 && duration.is_finite()) {
        return Err(Error::Range {
            argument: "duration".into(),
            requirement: "a positive finite time",
            value: duration,
        });
    }
    let scene = &propagators.scene;
    let rubs = scene.contacts.iter().any(|law| law.directions == Directions::Both);
    if scene.coordinates.coupled && rubs && !scene.impact_friction {
        return Err(Error::CoupledImpacts);
    }
    controls.validate()?;
    let (q, u) = coordinates_at(scene, start, controls.load_time)?;
    let panels = || propagators.locality().ok().map(|locality| duration / locality.width());
    let parts = || propagators.parts().iter().map(|part| &*part.block.scene);
    let pays = || marches_locally(scene, parts(), panels);
    if method == Method::Local || method == Method::Auto && pays() {
        return march::simulate(propagators, (q, u), &start.combination, duration, controls);
    }
    if !propagators.parts().is_empty() {
        return partitioned::simulate(
            propagators,
            (&q, &u),
            &start.combination,
            duration,
            method,
            controls,
        );
    }
    let mut run = Run::new(propagators, (q, u), duration, method, controls);
    let mut progress = run.begin(&start.combination)?;
    let reason = loop {
        if let Some(reason) = run.step(&mut progress)? {
            break reason;
        }
    };
    let mut trajectory = run.state.trajectory;
    trajectory.stop_reason = reason;
    trajectory.counters.phases = trajectory.phases.len();
    Ok(trajectory)
}
