//! What the core promises, shown by its public interface alone.

mod energy_balance;
mod invariants;
mod models;
mod records;
mod saltation;
mod stick_slip_oscillator;
mod stopped_computations;
mod transitions;
mod work;
