//! What the published runs cost: exact numbers, the same on every machine. Whoever changes how motion is followed or
//! events are found updates them here, and says why they became more.

use std::sync::atomic::{AtomicUsize, Ordering};

use stickslip_core::cycles::attractors::{SearchLimits, settle};
use stickslip_core::locus::{Path, WatchedPath, critical_points, first_hopf_point, hopf_points};
use stickslip_core::transient::Counters;
use stickslip_core::{Attractor, Method, Scene, State, StopReason};

use crate::models::{propagators, run, two_subsystems};

/// Steady sliding with 1 mm/s on the first mass.
fn pushed(scene: &stickslip_core::Scene) -> State {
    let mut start = scene.sliding_equilibrium().expect("steady sliding");
    start.velocity[0] += 1e-3;
    start
}

#[test]
fn phases_panels_and_refinements_of_the_published_runs() {
    // friction, slider speed, duration, method, events, counters
    let counters = |phases, panels, leaps, refinements, combinations, taylor_phases| Counters {
        phases,
        panels,
        leaps,
        refinements,
        combinations,
        taylor_phases,
        expansions: 0,
    };
    for (friction, speed, duration, method, events, expected) in [
        (1.5, 0.025, 0.6, Method::Auto, 312, counters(313, 729, 5, 546, 5, 0)),
        (1.5, 0.025, 0.6, Method::Taylor, 312, counters(313, 703, 0, 772, 5, 313)),
        (2.2, 0.05, 0.3, Method::Auto, 147, counters(148, 344, 7, 292, 6, 0)),
        (2.2, 0.05, 0.3, Method::Taylor, 147, counters(148, 355, 0, 386, 6, 148)),
    ] {
        let scene = propagators(two_subsystems(friction, speed));
        let start = pushed(scene.bare());
        let cold = run(&scene, &start, duration, method);
        assert_eq!(cold.events.len(), events);
        assert_eq!(cold.counters, expected);
        // What the propagators of a scene have met is not computed again.
        let warm = run(&scene, &start, duration, method);
        assert_eq!(warm.counters, Counters { combinations: 0, ..expected });
    }
}

/// The cycle that the standard run settles to, and how many of its combinations had to be decomposed for it.
#[test]
fn the_limit_cycle_of_the_standard_run() {
    let scene = propagators(two_subsystems(1.5, 0.025));
    let start = pushed(scene.bare());
    let search = SearchLimits {
        stretch: 0.6,
        limit: 1.2,
        method: Method::Auto,
        cancel: None,
        deadline: None,
    };
    let (attractor, last) = settle(&scene, &start, search).expect("a well-posed start");
    let Attractor::Cycle(found) = attractor else { panic!("no cycle") };
    assert_eq!(last.counters.combinations, 5);
    // Newton's method on the return map leaves some roundings of the orbit.
    assert!(found.cycle.orbit.residual <= 1e-12, "{}", found.cycle.orbit.residual);
    assert_eq!(found.cycle.stability.is_stable(), Some(true));
}

/// How many eigenproblems the Hopf points of the published model take, and how many modes are followed between the values
/// of the mesh; a study stops at the first point.
#[test]
fn eigenproblems_of_a_search_for_hopf_points() {
    let scene = Scene::new(two_subsystems(0.5, 0.025)).expect("a well-posed scene");
    let sliding = scene.sliding_combination().expect("sliders that move");
    let path = Path::contact_law([&scene, &scene], &sliding, &[0, 1], 0.0, 3.0).expect("a path");
    let eigenproblems = AtomicUsize::new(0);
    let watched = WatchedPath { path: &path, cancel: None, eigenproblems: &eigenproblems };
    let solved = || eigenproblems.swap(0, Ordering::Relaxed);
    let all = hopf_points(watched).expect("eigenvalues");
    let of_all = solved();
    let first = first_hopf_point(watched, |point| point.slope > 0.0).expect("eigenvalues");
    let of_first = solved();
    let none = first_hopf_point(watched, |_| false).expect("eigenvalues");
    let of_none = solved();
    critical_points(watched, 0.0).expect("eigenvalues");
    assert_eq!((of_all, of_first, of_none, solved()), (42, 13, 42, 276));
    assert_eq!((all.nodes, all.followed), (34, 12));
    assert_eq!(first.expect("a Hopf point").value, all.points[0].value);
    assert!(none.is_none());
}

/// Of a motion that has settled leaps have no end of their own: they used to go on for ever in so long a motion.
#[test]
fn a_settled_motion_of_any_length_ends() {
    let scene = propagators(two_subsystems(0.2, 0.025));
    let start = scene.bare().sliding_equilibrium().expect("steady sliding");
    let run = run(&scene, &start, 1e20, Method::Auto);
    assert_eq!((run.end, run.stop_reason), (1e20, StopReason::Duration));
    assert!(run.events.is_empty());
}
