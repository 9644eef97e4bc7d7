//! The error of the polynomials of a panel.
//!
//! The polynomial P of the state obeys `P' = A P + f + sum b_i y_i(P) - D` with a defect D whose coefficients are
//! those that the series leaves out, all of order DEGREE or more, and the rounding of the others: finite sums. With the norm
//! sigma of A and a Lipschitz bound l_i of y_i around P, `L = h (sigma + sum |b_i| l_i)` and `|D| <= t s^DEGREE + r`, the
//! error of P on a panel of width h is at most
//!
//! ```text
//! |X - P| <= h int e^(L (1 - s)) |D| ds <= h t / (DEGREE - L) + h r (e^L - 1) / L
//! ```
//!
//! (Gronwall, and `s <= e^(s - 1)`), as long as this is within the neighbourhood in which l_i holds. On a part f of the width,
//! t falls with f^DEGREE, and nothing else grows.
//!
//! The deflection of bristles relaxes, and where this is fast, a norm of all derivatives shortens panels that the series does not.
//! There L is a logarithmic norm, [`crate::motion::friction::state_norm`].
//!
//! The radius of that neighbourhood is free: any one proves the bound that is not above it. It is a part of the state, and where a
//! motion decays to zero under forces that do not, at least twice `h r (e^L - 1) / L`: rounding of forces, which no state bounds.

use nalgebra::DMatrix;

use crate::contact::functional::Functional;
use crate::motion::friction::motion::{LawMotion, Sliding, moved, worse};
use crate::motion::friction::operator::LawOperator;
use crate::motion::friction::plane::errors::{PanelSizes, PlaneBound};
use crate::motion::friction::series::coefficients::{UNIT, lowest, product_units, size};
use crate::motion::friction::series::convolutions::FactorSums;
use crate::motion::friction::series::law_contact::{Flow, LawContact};
use crate::motion::friction::series::panel_bound::{ContactBounds, LARGEST, PanelBound};
use crate::motion::series::size_of;
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE};
use crate::numerics::interval::Interval;
use crate::numerics::simd::{Kernel, Lanes};
use crate::scene::friction::law::FrictionLaw;
use crate::scene::model::Scene;

/// Radius of the neighbourhood of a polynomial in which Lipschitz bounds are taken, relative to the state.
const TUBE: f64 = 1e-6;
/// The same where slip has no mass: a law that levels off turns errors of places into far larger ones of slip speed.
const TUBE_OF_FLOW: f64 = 1e-9;
/// The same beside tables: where the neighbourhood holds steep pieces beside the one of the panel, their slopes count.
const TUBE_OF_TABLES: f64 = 1e-9;
/// Its largest change of a normal force there, relative to this force.
const NARROW: f64 = 0.01;
/// Share of the tube of slip speeds that errors of positions may use.
const PART_OF_TUBE: f64 = 0.25;
/// Its largest change of slip speed, relative to the change over which a law changes.
const TUBE_OF_SLIP: f64 = 0.1;

/// Times that the panel may still be shortened: to its truncation, and where a law ends it.
const TO_COME: usize = 2;
/// Units of rounding of a linear row per shortening of the panel: three powers of the factor, two coefficients and the width.
const PER_ROW: usize = 6;

/// Bounds of the error of the state and of the forces of laws.
struct Bound<'a> {
    motion: &'a mut LawMotion,
    scene: &'a Scene,
    operator: &'a LawOperator,
    scale: f64,
}

impl Kernel for Bound<'_> {
    type Output = PanelBound;

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> PanelBound {
        let Self { motion, scene, operator, scale } = self;
        let LawMotion {
            taylor,
            contacts,
            planes,
            coupling,
            sizes,
            shortenings,
            convolutions,
            powers,
            least_tube,
            uncounted,
            ..
        } = motion;
        let uncounted = *uncounted;
        let shortenings = *shortenings + TO_COME;
        let in_product = product_units(shortenings);
        let in_row = (operator.terms + 8 + PER_ROW * shortenings) as f64;
        let sizes = sizes.each_ref().map(|of| &of[..]);
        if let Some(rows) = &operator.taylor.dense {
            taylor.measure_outputs(simd, rows, sizes, powers);
        }
        let widened = operator.widened(scene);
        let reach = widened * operator.taylor.norm() * taylor.width;
        let last = taylor.norm_of(scene, &operator.taylor, DEGREE);
        let with_mass = |of: &(&LawContact, &Sliding)| of.0.flow.is_none();
        let slips = operator.contacts.iter().zip(&*contacts).filter(with_mass);
        let part = |of_scale: f64| (of_scale * scale).max(*least_tube);
        let slips = slips.filter(|of| !of.1.fades);
        let radius = slips.fold(part(TUBE), |radius, (one, sliding)| {
            let of_pieces = match one.law {
                FrictionLaw::Tabulated(_) | FrictionLaw::Pieces(_) => part(TUBE_OF_TABLES),
                _ => f64::INFINITY,
            };
            let of_slip = sliding.series.reach(&one.law) / one.slip_norm;
            let of_state = one
                .state
                .as_ref()
                .map_or(f64::INFINITY, |state| sliding.series.reach_of_state() / state.norm);
            radius.min(of_pieces).min(TUBE_OF_SLIP * of_slip).min(TUBE_OF_SLIP * of_state)
        });
        let turning = operator.planes.iter().zip(&*planes);
        let radius = turning.fold(radius, |radius, (one, series)| {
            let Some((law, series)) = series.law_of_speed(one) else { return radius };
            let of_pieces = match law {
                FrictionLaw::Tabulated(_) => part(TUBE_OF_TABLES),
                _ => f64::INFINITY,
            };
            radius.min(of_pieces).min(TUBE_OF_SLIP * series.reach(law) / one.speed_norm)
        });
        // Where slip has no mass, the slope of its law and its normal force are divided by.
        let flows = operator.contacts.iter().zip(&*contacts).filter(|of| of.0.flow.is_some());
        let radius = flows.fold(radius, |radius, (one, sliding)| {
            let pressed = NARROW * sliding.normal[0].abs() / one.normal_norm.abs();
            // Slip speeds stay within their own neighbourhood, also where the normal force is about to vanish.
            let series = &sliding.series;
            let divisor = series.slope(&one.law) * sliding.normal[0].abs();
            let spread = one.flow.as_ref().map_or(0.0, |flow| flow.friction_norm)
                + (one.law.value(0.0) + series.excess[0].abs()) * one.normal_norm;
            let slow = PART_OF_TUBE * series.tube(&one.law) * divisor / spread;
            radius.min(part(TUBE_OF_FLOW)).min(pressed).min(slow.abs())
        });
        let mut sums = convolutions.iter().flat_map(|pair| pair.sums(simd, powers));
        for (place, (one, sliding)) in operator.contacts.iter().zip(&mut *contacts).enumerate() {
            let sums = match sums.next().filter(|_| place < operator.paired) {
                Some(sums) => sums,
                None => FactorSums::alone(size(&sliding.series.excess)),
            };
            if let Some(input) = &one.state {
                let Sliding { series, state, bounds, force, .. } = sliding;
                if sliding.fades {
                    *bounds =
                        ContactBounds { pressed: size(&sliding.normal), ..Default::default() };
                    continue;
                }
                let mut beyond = [one.slip_norm, input.norm].map(|norm| radius * norm);
                beyond[1] += sliding.state_beyond;
                let moves = [state[0], moved(state)];
                let (law, by_state) =
                    series.bounds_with_state(&one.law, moves, beyond, shortenings);
                // The last order of the force is not integrated.
                let products = force[DEGREE].abs();
                let [excess, pressed, products] = match input.pressed {
                    false => [0.0, 1.0, products],
                    true => [sums.left[1], sums.right[1], products + sums.left_out[1]],
                };
                *bounds = ContactBounds {
                    law,
                    by_state,
                    excess,
                    pressed,
                    products,
                    ..Default::default()
                };
                continue;
            }
            let off = match one.flow {
                Some(_) => sliding.series.tube(&one.law),
                None => radius * one.slip_norm,
            };
            sliding.bounds = ContactBounds {
                law: sliding.series.bounds(&one.law, off, shortenings, &sums),
                excess: sums.left[1],
                pressed: sums.right[1],
                products: sliding.force[DEGREE].abs() + sums.left_out[1],
                ..ContactBounds::default()
            };
        }
        // Errors of the polynomials of N, the part of it by rounding where contacts are coupled, and the change of N per norm of the state.
        let of_normal = |(one, sliding): (&LawContact, &Sliding)| {
            [sliding.beyond + uncounted * one.normal_norm, 0.0, one.normal_norm]
        };
        let mut of_normals: Vec<[f64; 3]> =
            operator.contacts.iter().zip(&*contacts).map(of_normal).collect();
        if let Some(response) = &operator.response {
            coupled(
                operator,
                &response.normal,
                contacts,
                &mut of_normals,
                Given {
                    inverse: coupling.inverse_norm,
                    radius,
                    uncounted,
                    terms: (in_product + contacts.len()) as f64,
                },
            );
        }
        // Where the norm is the largest entry and contacts are apart, the worst one counts; else all together.
        let elements = operator.contacts.iter().any(LawContact::is_element);
        let coupled = scene.coupled_mass.is_some() || operator.response.is_some() || elements;
        let groups = operator.groups.as_ref().filter(|_| !coupled);
        // Truncation, rounding and change per error of the state.
        let mut sums = RowSums::new(groups.map(|groups| &groups[..]));
        let (mut flowing, mut follows) = (0.0, true);
        // Of states that relax: how they do, and defects of their rows.
        let (mut relaxing, mut relaxed, mut begins_apart) = (Vec::new(), [0.0_f64; 2], 0.0_f64);
        let units = (in_product + 16) as f64;
        for (place, (one, sliding)) in operator.contacts.iter().zip(&mut *contacts).enumerate() {
            let ContactBounds { law, excess, pressed, products: left_out, .. } = sliding.bounds;
            let [off, unsharp, pressed_by] = of_normals[place];
            let largest = excess + law.truncation + law.rounding;
            let cut = left_out + law.truncation * pressed + largest * off;
            let of_normal = match operator.taylor.dense {
                Some(_) if one.is_element() => 0.0,
                Some(_) => taylor.products.sizes(place)[0],
                None => size_of(&one.normal, sizes),
            };
            let size = sliding.at_origin_size + of_normal;
            let by_force = taylor.width * one.force_norm;
            if let (Some((_, fading)), true) = (one.fading(), sliding.fades) {
                // The spring is relaxed as its contact opens: what its deflection is off by counts by its effect on the motion until then.
                sums.add(place, [0.0, reach * by_force * fading.largest * pressed, 0.0]);
                continue;
            }
            let by_inputs = sliding.bounds.by_inputs(one);
            let (by_state, state_beyond) = (sliding.bounds.by_state, sliding.state_beyond);
            let of_state = one.state.as_ref().map_or(0.0, |state| {
                let size = sliding.state_at_origin[1] + size_of(&state.value, sizes);
                by_state * (UNIT * in_row * size + uncounted * state.norm)
            });
            let left_out = left_out + by_state * state_beyond * pressed;
            if one.is_bare() {
                let cut = left_out + law.truncation;
                let (round, gain) = (law.rounding + of_state, by_inputs);
                sums.add(place, [by_force * cut, by_force * round, one.force_norm * gain]);
                sliding.bounds = ContactBounds { cut, round, gain, ..sliding.bounds };
                continue;
            }
            let terms = in_product as f64 * pressed + in_row * size;
            // The argument of an element is a sum of displacements.
            let of_slip = match one.is_element() {
                true => {
                    law.slope() * (one.slip.position.len() + 2) as f64 * sliding.slip_at_origin[1]
                }
                false => 0.0,
            };
            let mut round = UNIT * (terms * excess + of_slip * pressed)
                + (law.rounding + of_state) * pressed
                + largest * unsharp;
            if let Some(flow) = &one.flow {
                let of = |at_origin: f64, sum: &Functional| at_origin + size_of(sum, sizes);
                let of_friction = of(sliding.friction_at_origin[1], &flow.friction);
                let of_normal = of(sliding.at_origin_size, &one.normal);
                let terms = in_row * (of_friction + one.law.value(0.0) * of_normal);
                let within = sliding.implicit(one, flow, [radius, off, terms, units]);
                let ContactBounds { cut, round, gain, by_force, .. } = sliding.bounds;
                let by_place = flow.weight * by_force;
                // The own spring of the coordinate takes differences back.
                let apart = gain - 2.0 * flow.spring / flow.weight;
                flowing = f64::max(flowing, by_place * apart.max(0.0));
                let by_place = taylor.width * by_place;
                sums.add(place, [by_place * cut, by_place * round, 0.0]);
                follows &= by_force * (gain * radius + cut + round) <= within;
                continue;
            }
            let slope = by_inputs * (pressed + off + unsharp + radius * pressed_by);
            let gain = largest * pressed_by + slope;
            match operator.states.as_ref().and_then(|states| states.state(place)) {
                Some(row) => {
                    let off_law =
                        law.truncation + law.rounding + law.slope() * radius * one.slip_norm;
                    let least = lowest(&sliding.series.excess) - off_law;
                    let wide = moved(&sliding.normal) + off + radius * one.normal_norm;
                    let around = |at: f64| Interval { low: at - wide, high: at + wide };
                    let turning = law.slopes * around(sliding.normal[0]);
                    relaxing.push(row.relaxation(turning, least));
                    let by_force = taylor.width * row.force_norm();
                    if sliding.followed.follows {
                        round += sliding.followed.defect();
                        begins_apart = begins_apart.max(row.weight * sliding.followed.apart);
                    }
                    relaxed = [(relaxed[0], cut), (relaxed[1], round)]
                        .map(|(largest, own)| largest.max(by_force * own));
                }
                None => {
                    sums.add(place, [by_force * cut, by_force * round, one.force_norm * gain]);
                }
            }
            sliding.bounds = ContactBounds { cut, round, gain, ..sliding.bounds };
        }
        for (place, (one, series)) in operator.planes.iter().zip(&*planes).enumerate() {
            let [mut sized, mut cut, mut round] =
                [series.at_origin[1] + size_of(&one.limit, sizes), series.beyond, 0.0];
            let mut limit_norm = one.limit_norm;
            for &(place, weight) in &one.pressed_by {
                let (Sliding { bounds, force, .. }, weight) = (&contacts[place], weight.abs());
                sized += weight * size(force);
                cut += weight * bounds.cut;
                round += weight * bounds.round;
                limit_norm += weight * bounds.gain;
            }
            round += UNIT * (in_row + one.pressed_by.len() as f64) * sized;
            let of_limit = [cut, round + uncounted * one.limit_norm];
            let width = taylor.width;
            let panel = PanelSizes { units, shortenings, width, of_limit, limit_norm, radius };
            let PlaneBound { cut, round, apart, growth } = series.error(one, &panel);
            let by_force = taylor.width * one.force_norm;
            let round = by_force * round + widened * apart / one.slip_norm;
            let place = operator.contacts.len() + place;
            sums.add(place, [by_force * cut, round, one.force_norm * growth]);
        }
        let [mut truncated, mut rounded, lipschitz] = sums.all();
        let beyond = reach / COEFFICIENTS as f64 * last;
        truncated += reach * (last + beyond);
        let of_orders: f64 = match scene.coupled_mass {
            // The largest row sum, over the sum of all orders.
            None => operator.taylor.largest_of(sizes, 1.0).run(simd),
            Some(_) => (0..COEFFICIENTS).map(|k| taylor.norm_of(scene, &operator.taylor, k)).sum(),
        };
        let load = widened * taylor.width * taylor.force_norm(&operator.taylor);
        // What the rows did not count is missing in the next order, and in the event functions.
        rounded += UNIT * in_row * (reach * of_orders + load) + (1.0 + reach) * uncounted;
        let mut exponent = (reach + widened * taylor.width * lipschitz).max(taylor.width * flowing);
        if let Some(states) = &operator.states {
            let [growth, of_state, largest] = states.growth(lipschitz, &relaxing, taylor.width);
            exponent = taylor.width * growth;
            relaxed[1] += begins_apart * (1.0 + exponent.max(0.0));
            [truncated, rounded] = [(truncated, relaxed[0]), (rounded, relaxed[1])]
                .map(|(others, own)| states.spread() * (largest * others + of_state * own));
        }
        let mut bound = PanelBound { truncated, rounded, beyond, exponent, radius, holds: false };
        bound.holds = follows && exponent <= LARGEST && bound.of_shorter(1.0) <= radius;
        bound
    }
}

/// Sums over the contacts of a combination: where the norm is the largest entry and contacts act on rows apart, the worst row counts.
struct RowSums<'a> {
    groups: Option<&'a [usize]>,
    /// By the first contact of each group; of all contacts where they are not apart.
    of: Vec<[f64; 3]>,
}

impl<'a> RowSums<'a> {
    fn new(groups: Option<&'a [usize]>) -> Self {
        Self { groups, of: Vec::new() }
    }

    fn add(&mut self, place: usize, parts: [f64; 3]) {
        let own = self.groups.map_or(0, |groups| groups.get(place).copied().unwrap_or(place));
        if self.of.len() <= own {
            self.of.resize(own + 1, [0.0; 3]);
        }
        self.of[own].iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
    }

    fn all(&self) -> [f64; 3] {
        [0, 1, 2].map(|i| self.of.iter().map(|sums| sums[i]).fold(0.0, worse))
    }
}

/// What the normal forces of coupled contacts are bounded with.
struct Given {
    /// The largest row sum of the inverse of `1 - H w_0`.
    inverse: f64,
    radius: f64,
    uncounted: f64,
    /// Units of rounding of a product and of a sum over all contacts.
    terms: f64,
}

/// The errors and the change of N of every contact, where forces H change those of some.
fn coupled(
    operator: &LawOperator,
    response: &DMatrix<f64>,
    contacts: &[Sliding],
    of_normals: &mut [[f64; 3]],
    Given { inverse, radius, uncounted, terms }: Given,
) {
    let count = contacts.len();
    let is_felt = |&i: &usize| (0..count).any(|j| response[(i, j)] != 0.0);
    let felt = |of: &dyn Fn(usize) -> f64| {
        let parts: Vec<f64> = (0..count).map(of).collect();
        let row = |i: usize| -> f64 {
            let entries = (0..count).map(|j| (response[(i, j)], parts[j]));
            entries.filter(|entry| entry.0 != 0.0).map(|(factor, part)| factor.abs() * part).sum()
        };
        (0..count).map(row).fold(0.0, worse)
    };
    let largest = |of: &dyn Fn(usize) -> f64| (0..count).filter(is_felt).map(of).fold(0.0, worse);
    // How far `1 - H w` moves from where the panel begins.
    let moves = |j: usize| {
        let (one, sliding) = (&operator.contacts[j], &contacts[j]);
        let of @ ContactBounds { law, .. } = sliding.bounds;
        match one.is_bare() || one.is_element() {
            true => 0.0,
            false => {
                let own = moved(&sliding.series.excess) + law.truncation + law.rounding;
                own + of.by_inputs(one) * radius
            }
        }
    };
    let drift = inverse * felt(&moves);
    let gain = if drift < 0.5 { inverse / (1.0 - drift) } else { f64::INFINITY };
    let cut = |j: usize| {
        let ContactBounds { products, law, pressed, .. } = contacts[j].bounds;
        products + law.truncation * pressed
    };
    let round = |j: usize| {
        let ContactBounds { law, excess, pressed, .. } = contacts[j].bounds;
        (law.rounding + UNIT * terms * (1.0 + excess)) * pressed
    };
    let by_inputs = |j: usize| {
        let of = contacts[j].bounds;
        of.by_inputs(&operator.contacts[j]) * of.pressed
    };
    let by_norm = |i: usize| operator.contacts[i].normal_norm;
    let beyond = |i: usize| contacts[i].beyond + uncounted * by_norm(i);
    let together = [
        gain * (largest(&beyond) + felt(&cut)),
        gain * (largest(&round) + felt(&round)),
        gain * (largest(&by_norm) + felt(&by_inputs)),
    ];
    for (i, own) in of_normals.iter_mut().enumerate() {
        *own = if is_felt(&i) { together } else { [beyond(i), 0.0, by_norm(i)] };
    }
}

impl Sliding {
    /// Where slip has no mass: bounds of what its velocity q_t' does not balance, and of its change with the state. Gives the
    /// distance from the polynomial S within which S has to stay for them. `radius` bounds the error of the state, `off`
    /// that of N, and `terms` and `units` count rounding of R and N, and of products.
    ///
    /// With the polynomials P of the state, R and N of the forces and S of the slip speed, `mu(S) N - R = e` with coefficients
    /// of order DEGREE or more, and rounding. So the slip speed that belongs to P is at most `|e| / (least mu' least N)`
    /// from S, and that of a state X at most `(|R'| + mu |N'|) |X - P| / (least mu' least N)` from the one that belongs to
    /// P. In the growth of a difference of places, which is the largest entry of the norm, the own stiffness counts with its
    /// sign: `d' = -(K_tt d + ..) / (mu' N)`.
    fn implicit(
        &mut self,
        one: &LawContact,
        flow: &Flow,
        [radius, off, terms, units]: [f64; 4],
    ) -> f64 {
        let tube = self.series.tube(&one.law);
        let ContactBounds { law, excess, pressed, products, .. } = self.bounds;
        let at_rest = one.law.value(0.0);
        let largest = at_rest + excess + law.truncation + law.rounding;
        let moving: f64 = self.normal[1..].iter().map(|c| c.abs()).sum();
        let pressed_least = self.normal[0] - moving - off - radius * one.normal_norm;
        let slope = self.series.least_slope(&one.law, tube);
        let divisor = if slope > 0.0 && pressed_least > 0.0 { slope * pressed_least } else { 0.0 };
        // The first slip speed leaves what the iteration to it has left.
        let left = (self.series.excess[0] * self.normal[0] - self.force[0]).abs();
        let slips = law.slope() * size(&self.series.slip);
        let terms = terms + units * (at_rest + excess + slips) * pressed;
        let cut = products + law.truncation * pressed + largest * off + self.friction_beyond;
        let round = left + law.rounding * pressed + UNIT * terms;
        // mu at the slip speed that belongs to P.
        let balanced = largest + (cut + round) / pressed_least;
        self.bounds = ContactBounds {
            cut,
            round,
            gain: flow.friction_norm + balanced * one.normal_norm,
            by_force: 1.0 / divisor,
            ..self.bounds
        };
        tube
    }
}

impl LawMotion {
    /// Bounds of the error of the state and of the forces of laws.
    pub(super) fn bound(
        &mut self,
        scene: &Scene,
        operator: &LawOperator,
        scale: f64,
    ) -> PanelBound {
        let unit = self.unit;
        self.taylor.measure();
        let [constant, linear, higher] = self.taylor.sizes();
        for (half, all) in self.sizes.iter_mut().enumerate() {
            all.clear();
            let orders = constant[half].iter().zip(&linear[half]).zip(&higher[half]);
            all.extend(orders.map(|((constant, linear), higher)| constant + linear + higher));
        }
        unit.run(Bound { motion: self, scene, operator, scale })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::SparseMatrix;
    use crate::motion::combination_basis::{CombinationBasis, Propagator};
    use crate::motion::method::Wanted;
    use crate::scene::status::{Combination, Status};
    use crate::scene::{ContactInput, Damping, Decay, Direction, Mass, SceneInput};

    const SPRING: f64 = 50.0;
    const PRESSED: f64 = 4.0;
    const SPEED: f64 = 0.2;

    /// A dof without mass on a spring, beside a mass on its own.
    fn relaxing(law: &FrictionLaw) -> Scene {
        let contact = ContactInput {
            tangential: Some(Direction::Dof(1)),
            normal: None,
            normal_force: PRESSED,
            friction: law.value(0.0),
            static_friction: law.value(0.0),
            slider_speed: SPEED,
            ..Default::default()
        };
        let input = SceneInput {
            mass: Mass::Lumped(vec![1.0, 0.0]),
            stiffness: SparseMatrix::diagonal(&[100.0, SPRING]),
            damping: Damping::Proportional { mass: 0.0, stiffness: 0.0 },
            force: vec![0.0; 2],
            contacts: vec![contact],
            ..Default::default()
        };
        let scene = Scene::new(input).expect("well-posed");
        scene.with_friction_laws(vec![Some(law.clone())]).expect("a law that rises")
    }

    /// The time that the coordinate takes to a place, up to a constant, from `q' = v - |s|` and `mu(|s|) N = k q`.
    fn time_to(law: &FrictionLaw, place: f64) -> f64 {
        let excess = SPRING * place / PRESSED - law.value(0.0);
        match law {
            FrictionLaw::Linear { slope, .. } => {
                -PRESSED * slope / SPRING * (SPEED - excess / slope).abs().ln()
            }
            FrictionLaw::Decaying { at_rest, kinetic, speed, .. } => {
                let rise = kinetic - at_rest;
                let (a, b) = (SPEED * rise, SPEED + speed);
                let left = (rise - a / b) / b * (a - b * excess).abs().ln();
                PRESSED / SPRING * (excess / b - left)
            }
            _ => f64::NAN,
        }
    }

    /// Every panel of slip without mass is within its bound of the closed form, and the bound is far below the motion.
    #[test]
    fn panels_of_first_order_are_within_their_bounds() {
        let laws = [
            FrictionLaw::Linear { at_rest: 0.3, slope: 0.5 },
            FrictionLaw::Linear { at_rest: 0.3, slope: 0.02 },
            FrictionLaw::Decaying {
                at_rest: 0.3,
                kinetic: 0.5,
                speed: 0.3,
                viscous: 0.0,
                decay: Decay::Rational,
            },
        ];
        for law in &laws {
            let scene = relaxing(law);
            let combination = Combination::new(vec![Status::Positive]);
            let basis =
                CombinationBasis::new(&scene, &combination, Wanted::Series).expect("slides");
            let Propagator::Law(operator) = &basis.propagator else { panic!("not by its law") };
            let own = basis.scene(&scene);
            let t = scene.contacts[0].tangential;
            for part in 1..40 {
                let size = scene.mass.size();
                let (mut q, mut u) = (vec![0.0; size], vec![0.0; size]);
                // Faster and slower than steady sliding.
                q[t] = PRESSED / SPRING * (0.3 + 0.0041 * f64::from(part));
                basis.complete(&mut q, &mut u);
                let mut motion = LawMotion::default();
                motion.restart(own, operator, &basis.functions, &q, &u);
                let weight = operator.contacts[0].flow.as_ref().expect("no mass").weight;
                for _ in 0..8 {
                    let (start, width) = (q[t], motion.end() - motion.start());
                    motion.state(operator, width, &mut q, &mut u);
                    // The time to steady sliding is infinite.
                    if u[t].abs() < 1e-9 {
                        break;
                    }
                    let late = time_to(law, q[t]) - time_to(law, start) - width;
                    let off = (late * u[t]).abs();
                    let rounding = 64.0 * f64::EPSILON * (time_to(law, start) * u[t]).abs();
                    let bound = motion.left_out / weight;
                    assert!(off <= bound + rounding, "{law:?} {part}: {off:e} {bound:e}");
                    assert!(bound < 1e-8 * q[t].abs(), "{law:?} {part}: {bound:e}");
                    motion.advance(own, operator);
                }
            }
        }
    }
}
