//! Contacts that mass couples: a force or an impulse on one of them accelerates all of them.

pub(crate) mod contact_problem;
pub(crate) mod contacts;
pub(crate) mod dependent;
pub(crate) mod joint_closing;
mod one_solution;
mod proposed_statuses;
pub(crate) mod transition;
