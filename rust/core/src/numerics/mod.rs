//! Numerical tools that know nothing of mechanics: certified roots, exact arithmetic, SIMD lanes, quadrature.

pub(crate) mod bracket;
pub(crate) mod complementarity;
pub(crate) mod double_double;
pub(crate) mod first_root;
pub(crate) mod gauss;
pub(crate) mod interval;
pub(crate) mod phi;
pub(crate) mod platform;
pub(crate) mod simd;
pub(crate) mod singular_values;

pub use platform::arithmetic;
