//! A motion that keeps every k-th state only gives the same numbers as one that keeps all.

use stickslip_core::energy::works;
use stickslip_core::transient::TrajectoryRecord;
use stickslip_core::{Controls, Method, Propagators, State, Trajectory, simulate};

use std::sync::Arc;

use crate::models::{propagators, two_subsystems};

fn run(scene: &Arc<Propagators>, start: &State, method: Method, kept: Option<usize>) -> Trajectory {
    let controls = Controls { kept_numbers: kept, ..Controls::default() };
    simulate(scene, start, 0.6, method, controls).expect("a run")
}

/// Positions and velocities at many times, as bits.
fn samples(run: &Trajectory, times: impl Iterator<Item = usize>) -> Vec<u64> {
    let times: Vec<f64> = times.map(|k| run.end * k as f64 / 1000.0).collect();
    let sample = run.sample(&times).expect("times within the motion");
    let numbers = sample.position.iter().chain(&sample.velocity).chain(&sample.friction_force);
    numbers.map(|x| x.to_bits()).collect()
}

fn record(run: &Trajectory) -> TrajectoryRecord {
    let mut record = run.record();
    record.whole.counters = Default::default();
    record
}

#[test]
fn states_between_the_kept_ones_come_back_to_the_last_bit() {
    let scene = propagators(two_subsystems(1.5, 0.025));
    let mut start = scene.bare().sliding_equilibrium().expect("steady sliding");
    start.velocity[0] += 1e-3;
    for method in [Method::Auto, Method::Taylor] {
        let all = run(&scene, &start, method, None);
        let phases = all.counters.phases;
        // 313 phases of 16 numbers.
        for states in [1, 2, 7, 100] {
            let few = run(&scene, &start, method, Some(16 * states));
            assert_eq!(few.counters.phases, phases);
            // At most so many states, and the departures of two contacts.
            assert!(few.kept_bytes() <= states * (16 + 2 * 4) * 8, "{}", few.kept_bytes());
            assert_eq!(record(&few), record(&all));
            // In order and backwards, where stretches are run again in another order.
            assert_eq!(samples(&few, 0..=1000), samples(&all, 0..=1000));
            assert_eq!(samples(&few, (0..=1000).rev()), samples(&all, (0..=1000).rev()));
            let [some, whole] = [&few, &all].map(|run| works(run, 0.1, 0.5).expect("works"));
            assert_eq!((some.kinetic, some.elastic), (whole.kinetic, whole.elastic));
            assert_eq!(format!("{:?}", some.impacts), format!("{:?}", whole.impacts));
            for event in few.events.iter().rev().step_by(5) {
                assert_eq!(few.event_state(event), all.event_state(event));
            }
        }
    }
}
