//! The first root of a polynomial that is known up to an error bound, certified.

#[cfg(test)]
mod fuzz;
pub(crate) mod polynomial;
pub(crate) mod search;
