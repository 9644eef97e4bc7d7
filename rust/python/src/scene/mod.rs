//! Scenes: what describes them, chains of subsystems, and the questions to a scene alone.

pub mod chain;
pub mod input;
pub mod model;
