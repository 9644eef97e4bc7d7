//! One spring or damper: its argument, its force and its energy.

use crate::numerics::gauss::gauss_rule;
use crate::scene::friction::law::FrictionLaw;

/// Part of the first piece of a table below which the stretch of the spring of a contact is none.
const RELAXED: f64 = 1e-9;
/// Halvings of a stretch over which the work of a spring is integrated.
const HALVINGS: usize = 12;
/// Change of a work by a halving that is rounding, relative to its terms.
const INTEGRATED: f64 = 16.0 * f64::EPSILON;

/// What the force of an element depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ElementKind {
    /// The stretch `d . x - offset`, m.
    Spring,
    /// Its rate `d . x'`, m/s.
    Damper,
}

/// A spring or a damper as it is given.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementInput {
    /// What its force depends on.
    pub kind: ElementKind,
    /// Where it acts.
    pub place: ElementPlace,
    /// The stretch at `x = 0` is minus this, m; 0 of a damper.
    pub offset: f64,
    /// phi, N, over m or m/s of either sign.
    pub law: FrictionLaw,
}

/// Where a spring or a damper acts.
#[derive(Debug, Clone, PartialEq)]
pub enum ElementPlace {
    /// Along d: (dof, entry).
    Direction(Vec<(usize, f64)>),
    /// Between the node of a compliant contact and the body, along its normal: the stretch is the penetration
    /// `-(n . x + gap)`. It presses while the contact is closed; the stiffness of the contact is the slope of its law at zero.
    Contact(usize),
}

/// A spring or a damper in contact coordinates.
#[derive(Debug, Clone)]
pub(crate) struct Element {
    pub kind: ElementKind,
    /// d
    pub direction: Vec<(usize, f64)>,
    pub offset: f64,
    /// The contact whose spring it is.
    pub contact: Option<usize>,
    /// Of such a spring the stiffness that the node has without it, N/m.
    pub node_stiffness: f64,
    /// psi
    pub excess: FrictionLaw,
    /// phi(0) and phi'(0), as far as they are no part of the matrices before; of the spring of a contact zeros.
    pub linear: [f64; 2],
}

impl Element {
    /// Whether its linear part is all of it.
    pub fn is_linear(&self) -> bool {
        matches!(self.excess, FrictionLaw::Linear { slope: 0.0, .. })
    }

    pub const fn is_tabulated(&self) -> bool {
        matches!(self.excess, FrictionLaw::Tabulated(_))
    }

    /// Its stretch, or the rate of a damper.
    pub fn argument(&self, q: &[f64], u: &[f64]) -> f64 {
        let state = if self.kind == ElementKind::Spring { q } else { u };
        self.along(state) - self.offset
    }

    /// `d . x` of a vector in contact coordinates.
    pub fn along(&self, x: &[f64]) -> f64 {
        self.direction.iter().map(|&(k, weight)| weight * x[k]).sum()
    }

    /// Whether the spring of a contact has no stretch, or one that is none to a table, whose slope there may be zero.
    pub fn is_relaxed(&self, q: &[f64]) -> bool {
        let least = match &self.excess {
            FrictionLaw::Tabulated(table) => RELAXED * table.speeds.get(1).copied().unwrap_or(0.0),
            _ => 0.0,
        };
        self.along(q) <= least
    }

    /// Whether the formula of the spring of a contact has come to a zero of its own, and not to that of its stretch, where psi
    /// vanishes beside the linear part.
    pub fn pulls(&self, q: &[f64]) -> bool {
        let stretch = self.along(q);
        let linear = self.node_stiffness * stretch;
        !self.is_tabulated() && linear > 0.0 && self.excess.value(stretch) < -0.5 * linear
    }

    /// The constant part of its force, which is a part of F.
    pub fn preload(&self) -> f64 {
        self.linear[0] - self.linear[1] * self.offset
    }

    /// `int phi` of a spring from its natural length to a state, less the part `1/2 phi'(0) (d . x)^2` that K stores.
    pub fn energy(&self, q: &[f64]) -> f64 {
        if self.kind == ElementKind::Damper {
            return 0.0;
        }
        let [_, slope] = self.linear;
        let (along, stretch) = (self.along(q), self.along(q) - self.offset);
        let offset = self.offset;
        self.linear[0] * stretch + slope * offset * (0.5 * offset - along) + self.work(0.0, stretch)
    }

    /// Its change between two states.
    pub fn energy_change(&self, from: &[f64], to: &[f64]) -> f64 {
        if self.kind == ElementKind::Damper {
            return 0.0;
        }
        let change: f64 =
            self.direction.iter().map(|&(k, weight)| weight * (to[k] - from[k])).sum();
        let [first, last] = [from, to].map(|q| self.along(q) - self.offset);
        self.preload() * change + self.work(first, last)
    }

    /// `int psi` from one stretch to another, piece by piece.
    fn work(&self, from: f64, to: f64) -> f64 {
        let mut ends = vec![from, to];
        let (low, high) = (from.min(to), from.max(to));
        ends.extend(self.excess.knots().iter().filter(|&&knot| low < knot && knot < high));
        ends.sort_by(f64::total_cmp);
        if to < from {
            ends.reverse();
        }
        ends.windows(2).map(|pair| self.smooth_work(pair[0], pair[1], HALVINGS)).sum()
    }

    fn smooth_work(&self, from: f64, to: f64, halvings: usize) -> f64 {
        let middle = 0.5 * (from + to);
        let halves = [self.by_rule(from, middle), self.by_rule(middle, to)];
        let (whole, parts) = (self.by_rule(from, to), halves[0] + halves[1]);
        // psi has the rounding of the line that is taken off.
        let [value, slope] = self.linear;
        let line = value.abs() + slope.abs() * from.abs().max(to.abs());
        let size = halves[0].abs() + halves[1].abs() + line * (to - from).abs();
        if halvings == 0 || !((whole - parts).abs() > INTEGRATED * size) {
            return parts;
        }
        self.smooth_work(from, middle, halvings - 1) + self.smooth_work(middle, to, halvings - 1)
    }

    fn by_rule(&self, from: f64, to: f64) -> f64 {
        let rule = gauss_rule();
        let terms = rule.nodes.iter().zip(&rule.weights);
        let sum: f64 =
            terms.map(|(node, weight)| weight * self.excess.value(from + node * (to - from))).sum();
        sum * (to - from)
    }

    pub fn has_value(&self, argument: f64) -> bool {
        self.excess.value(argument).is_finite() && self.excess.slope(argument).is_finite()
    }
}
