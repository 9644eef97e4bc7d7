//! What is computed of an orbit ends at once when it is over, interrupted or late.

use std::cell::Cell;

use stickslip_core::cycles::attractors::{SearchLimits, closed};
use stickslip_core::cycles::orbits::OrbitFailure;
use stickslip_core::{Cancel, Cycle, Method};

use crate::models::{belt, block, cycle, propagators, run, state};

#[test]
fn every_computation_of_an_orbit_stops() {
    let scene = propagators(block(belt()));
    let start = state(&[0.2, 0.0], &[0.1, 0.0], "s");
    let orbit = cycle(&scene, &start, 60.0, Method::Auto).orbit;
    let over = || true;
    let stopped = [
        Cycle::new(orbit.clone(), &over).map(drop),
        orbit.continued(&scene, &over).map(drop),
        orbit.margins(&over).map(drop),
        orbit.multipliers(&over).map(drop),
        orbit.harmonics(1_000_000, &over).map(drop),
    ];
    for (place, found) in stopped.into_iter().enumerate() {
        assert_eq!(found, Err(OrbitFailure::Stopped), "{place}");
    }
    let cancel = Cancel::default();
    cancel.request();
    let search = SearchLimits {
        stretch: 0.0,
        limit: 0.0,
        method: Method::Auto,
        cancel: Some(&cancel),
        deadline: None,
    };
    let motion = run(&scene, &start, 60.0, Method::Auto);
    assert!(!matches!(closed(&motion, search), Ok(Some(_))));
}

/// Harmonics of every phase ask again and again, and change nothing by it.
#[test]
fn what_is_not_over_goes_on() {
    let scene = propagators(block(belt()));
    let orbit = cycle(&scene, &state(&[0.2, 0.0], &[0.1, 0.0], "s"), 60.0, Method::Auto).orbit;
    let asked = Cell::new(0);
    let counted = || {
        asked.set(asked.get() + 1);
        false
    };
    let many = orbit.harmonics(1000, &counted).expect("an orbit").displacement;
    assert!(asked.get() >= 2 * 1000 / 100, "{}", asked.get());
    let few = orbit.harmonics(10, &|| false).expect("an orbit").displacement;
    assert_eq!(few[..], many[..few.len()]);
}
