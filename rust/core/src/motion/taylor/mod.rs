//! A phase as Taylor series, from its equation of motion alone.

pub(crate) mod bordered;
pub(crate) mod doubled_products;
mod following;
pub(crate) mod function_rows;
pub(crate) mod held_modes;
pub(crate) mod motion;
pub(crate) mod operator;
pub(crate) mod rows;
