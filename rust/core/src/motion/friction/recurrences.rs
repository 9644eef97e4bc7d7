//! The recurrences of a panel, order by order: slip speeds and normal forces, laws, forces, and the next order of the state.

use crate::motion::friction::motion::{LawMotion, Sliding, TRIALS};
use crate::motion::friction::operator::LawOperator;
use crate::motion::friction::series::convolutions::SHARING;
use crate::motion::friction::series::law_contact::{Flow, LawContact};
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE};
use crate::numerics::simd::{GROUP, Kernel, Lanes, group};
use crate::scene::model::Scene;

/// How far an order of a slip speed may go, relative to what its law allows: the 29th power of it is within the range of numbers.
const WIDE: f64 = 1e3;

struct Recurrences<'a> {
    motion: &'a mut LawMotion,
    scene: &'a Scene,
    operator: &'a LawOperator,
}

impl Kernel for Recurrences<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { motion, scene, operator } = self;
        motion.convolutions.iter_mut().for_each(|all| all.clear());
        if let Some(rows) = &operator.taylor.dense {
            motion.taylor.begin_rows(rows);
        }
        for k in 0..COEFFICIENTS {
            if let Some(rows) = &operator.taylor.dense {
                rows.multiply(simd, k, &mut motion.taylor.products);
            }
            motion.laws(simd, operator, k);
            if let Some(response) = &operator.response {
                motion.couple(&response.normal, k);
                motion.coupled_forces(k);
            }
            if k < DEGREE {
                motion.next(simd, scene, operator, k);
            }
        }
        motion.convolutions.iter_mut().for_each(|all| all.set(DEGREE, all.newest));
        motion.taylor.force.copy_from_slice(&motion.base);
    }
}

impl LawMotion {
    /// The recurrences of state, slip speed, normal force and law.
    pub(super) fn recur(&mut self, scene: &Scene, operator: &LawOperator) {
        let unit = self.unit;
        unit.run(Recurrences { motion: self, scene, operator });
        for (one, sliding) in operator.contacts.iter().zip(&mut self.contacts) {
            sliding.beyond = self.taylor.displacement(&one.normal, COEFFICIENTS).abs();
            if let Some(flow) = &one.flow {
                sliding.friction_beyond =
                    self.taylor.displacement(&flow.friction, COEFFICIENTS).abs();
            }
        }
    }

    /// The series, on a panel so narrow that no order of a slip speed goes far beyond what its law allows. A law that changes
    /// over a small speed multiplies it by itself with every order; on the usual width this would leave the range of numbers,
    /// and no shorter panel could be told from it.
    pub(super) fn recur_in_range(&mut self, scene: &Scene, operator: &LawOperator) {
        for _ in 0..TRIALS {
            self.recur(scene, operator);
            let laws = operator.contacts.iter().zip(&self.contacts);
            let part = laws.fold(1.0, |part: f64, (one, Sliding { series, .. })| {
                let reach = series.reach(&one.law);
                if series.range() <= WIDE * reach {
                    return part;
                }
                // The orders after the first large one follow from it.
                let far = (1..COEFFICIENTS).find(|&k| series.slip[k].abs() > WIDE * reach);
                far.map_or(part, |k| part.min((reach / series.slip[k].abs()).powf(1.0 / k as f64)))
            });
            if !(part > 0.0 && part < 1.0) {
                break;
            }
            self.taylor.begin_within(part);
        }
    }

    /// The laws, and their forces; where contacts are coupled, as far as these follow from lower orders of N.
    #[inline(always)]
    fn laws<S: Lanes>(&mut self, simd: S, operator: &LawOperator, k: usize) {
        for pair in 0..self.convolutions.len() {
            let convolutions = &self.convolutions[pair];
            let middle = convolutions.middle(simd, k, convolutions.newest);
            let [a, b, c, d]: [f64; GROUP] = pulp::cast(middle);
            // One after the other, so that their factors stay in registers.
            let [left_a, right_a, left_b, right_b] = self.law(operator, SHARING * pair, k, [a, b]);
            let [left_c, right_c, left_d, right_d] =
                self.law(operator, SHARING * pair + 1, k, [c, d]);
            let left = group([left_a, left_b, left_c, left_d]);
            let right = group([right_a, right_b, right_c, right_d]);
            self.convolutions[pair].push(k, [left, right]);
        }
    }

    /// One law and its force, from the terms of its two products with lower orders. Gives the factors of both products.
    #[inline(always)]
    fn law(&mut self, operator: &LawOperator, i: usize, k: usize, middle: [f64; 2]) -> [f64; 4] {
        let Self { taylor, contacts, .. } = self;
        let Some(sliding) = contacts.get_mut(i) else { return [0.0; 4] };
        let one = &operator.contacts[i];
        if let Some(flow) = &one.flow {
            return self.flow(one, flow, i, k, middle);
        }
        // The slip speed, and the normal force without those of laws.
        let slip = match (&operator.taylor.dense, one.slip.single()) {
            (Some(_), Some((1, place, weight))) => {
                -one.sign * weight * taylor.products.velocity(place)
            }
            _ => -one.sign * taylor.coefficient(&one.slip, k),
        };
        let of_normal = match &operator.taylor.dense {
            Some(rows) => taylor.products.outputs(rows, k)[i],
            None => taylor.coefficient(&one.normal, k),
        };
        sliding.step(one, k, [slip, of_normal], middle, operator.response.is_some())
    }

    /// The same where slip has no mass: the force is known from its balance, and the slip speed follows.
    fn flow(
        &mut self,
        one: &LawContact,
        flow: &Flow,
        i: usize,
        k: usize,
        middle: [f64; 2],
    ) -> [f64; 4] {
        let Self { taylor, contacts, .. } = self;
        let Sliding { series, normal, force, at_origin, friction_at_origin, .. } = &mut contacts[i];
        let mut friction = taylor.coefficient(&flow.friction, k);
        normal[k] = taylor.coefficient(&one.normal, k);
        if k == 0 {
            friction += friction_at_origin[0];
            normal[0] += *at_origin;
        }
        force[k] = friction - one.law.value(0.0) * normal[k];
        // Without a normal force the phase ends here.
        let (slip, of_lower) = if !(normal[0] > 0.0) {
            (0.0, middle[0])
        } else if k == 0 {
            (one.law.speed_at(force[0] / normal[0]), 0.0)
        } else {
            let known = series.excess[0].mul_add(normal[k], middle[1]);
            let (without, _) = series.extend(&one.law, k, 0.0, middle[0]);
            let slip = ((force[k] - known) / normal[0] - without) / series.slope(&one.law);
            (slip, middle[0])
        };
        let (excess, [left, right]) = series.extend(&one.law, k, slip, of_lower);
        let still = if k == 0 { flow.slider_speed } else { 0.0 };
        taylor.flow(flow.coordinate, k, still - one.sign * slip);
        [left, right, excess, normal[k]]
    }

    /// The forces of laws of coupled contacts, and the normal forces that they led to.
    #[inline(always)]
    fn coupled_forces(&mut self, k: usize) {
        let Self { contacts, convolutions, .. } = self;
        for (place, Sliding { series, normal, force, .. }) in contacts.iter_mut().enumerate() {
            force[k] += series.excess[0] * normal[k];
            convolutions[place / SHARING].set_normal(place % SHARING, normal[k]);
        }
    }

    /// The next order of the state.
    #[inline(always)]
    fn next<S: Lanes>(&mut self, simd: S, scene: &Scene, operator: &LawOperator, k: usize) {
        let Self { taylor, contacts, base, .. } = self;
        if let Some(rows) = &operator.taylor.dense {
            if k == 0 {
                rows.load(base, taylor.products.states(rows));
            }
            let h = taylor.width;
            let factors = [h * h / ((k + 1) * (k + 2)) as f64, (k + 2) as f64 / h];
            let forces = |contact: usize| contacts[contact].force[k];
            return taylor.next_by_rows(simd, rows, k, forces, factors);
        }
        if k == 0 {
            taylor.force.copy_from_slice(base);
        } else {
            taylor.force.fill(0.0);
        }
        for (one, sliding) in operator.contacts.iter().zip(contacts) {
            one.push(sliding.force[k], &mut taylor.force);
        }
        taylor.order(scene, &operator.taylor, k, true);
    }
}

impl Sliding {
    /// Coefficients of order k of the law and its force, from those of slip velocity and normal force and the terms of the two
    /// products with lower orders. Gives the factors of both products.
    #[inline(always)]
    fn step(
        &mut self,
        one: &LawContact,
        k: usize,
        [mut slip, mut of_normal]: [f64; 2],
        middle: [f64; 2],
        coupled: bool,
    ) -> [f64; 4] {
        let Self { series, normal, force, at_origin, .. } = self;
        if k == 0 {
            slip -= one.sign * one.slip.constant;
            of_normal += *at_origin;
        }
        let (excess, [left, right]) = series.extend(&one.law, k, slip, middle[0]);
        normal[k] = of_normal;
        let known = if k == 0 { 0.0 } else { excess.mul_add(normal[0], middle[1]) };
        // The normal force of this order is known last.
        force[k] = if coupled { known } else { series.excess[0].mul_add(of_normal, known) };
        [left, right, excess, of_normal]
    }
}
