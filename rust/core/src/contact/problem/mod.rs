//! The contact problem of an event: the statuses and forces of contacts that act on each other.

pub(crate) mod conditions;
pub(crate) mod contact_problem;
pub(crate) mod dependent;
pub(crate) mod held_rows;
mod one_solution;
mod proposed_statuses;
#[cfg(test)]
mod tests;
mod verification;
