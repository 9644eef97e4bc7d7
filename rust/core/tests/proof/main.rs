//! What the core promises, shown by its public interface alone.

mod damaged_records;
mod energy_balance;
mod invariants;
mod kept_states;
mod models;
mod saltation;
mod stick_slip_oscillator;
mod stopped_computations;
mod transitions;
mod work;
