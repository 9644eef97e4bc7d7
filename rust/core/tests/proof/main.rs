//! What the core promises, shown by its public interface alone.

mod damaged_records;
mod invariants;
mod kept_states;
mod models;
mod saltation;
mod stick_slip_oscillator;
mod transitions;
mod work;
