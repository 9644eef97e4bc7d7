//! Contacts that mass couples: a force or an impulse on one of them accelerates all of them.

pub(crate) mod contacts;
pub(crate) mod joint_closing;
pub(crate) mod transition;
