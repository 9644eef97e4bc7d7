//! The parts of which panels under laws of friction are made: series, products of rows, and bounds.

pub(crate) mod coefficients;
pub(crate) mod convolutions;
pub(crate) mod elastic_plane;
pub(crate) mod followed_state;
pub(crate) mod formula_series;
pub(crate) mod law_contact;
pub(crate) mod law_series;
pub(crate) mod panel_bound;
pub(crate) mod state_derivatives;
