//! The first root of a polynomial that is known up to an error bound, certified.

#[cfg(test)]
mod fuzz;
#[cfg(test)]
mod planted_dips;
pub(crate) mod polynomial;
pub(crate) mod search;
