//! The entries of a that statuses hold at zero, each by a force that no other gives.

use crate::scene::status::Status;

/// An entry of a that vanishes, (tangential, normal) of a contact in its row, and the force there that makes it vanish.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HeldRow {
    pub row: usize,
    /// Friction of a contact that slides, in the row before, per its normal force.
    friction: f64,
}

impl HeldRow {
    /// The forces that one newton in this row brings, itself first: the row of each, and its value.
    pub fn forces(self) -> impl Iterator<Item = (usize, f64)> {
        let friction = (self.friction != 0.0).then(|| (self.row - 1, self.friction));
        std::iter::once((self.row, 1.0)).chain(friction)
    }
}

/// The rows that statuses hold, ascending; `friction` is mu of a contact.
pub(crate) fn held_rows(statuses: &[Status], friction: impl Fn(usize) -> f64) -> Vec<HeldRow> {
    let mut held = Vec::new();
    for (i, status) in statuses.iter().enumerate() {
        let [t, n] = [2 * i, 2 * i + 1];
        held.extend((*status == Status::Sticking).then_some(HeldRow { row: t, friction: 0.0 }));
        let friction = || status.friction_sign() * friction(i);
        held.extend(status.is_closed().then(|| HeldRow { row: n, friction: friction() }));
    }
    held
}
