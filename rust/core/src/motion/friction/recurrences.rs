//! The recurrences of a panel, order by order: slip speeds and normal forces, laws, forces, and the next order of the state.

use crate::motion::friction::motion::{LawMotion, Sliding};
use crate::motion::friction::operator::LawOperator;
use crate::motion::friction::series::convolutions::SHARING;
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE};
use crate::numerics::simd::{GROUP, Kernel, Lanes, group};
use crate::scene::model::Scene;

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
        for k in 0..COEFFICIENTS {
            motion.multiply(simd, operator, k);
            motion.laws(simd, operator, k);
            if let Some(response) = &operator.response {
                motion.couple(&response.normal, k);
                motion.coupled_forces(k);
            }
            if k < DEGREE {
                motion.next(simd, scene, operator, k);
            }
        }
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
        }
    }

    /// Of small combinations the rows of order k.
    #[inline(always)]
    fn multiply<S: Lanes>(&mut self, simd: S, operator: &LawOperator, k: usize) {
        let Self { taylor, rows, outputs, .. } = self;
        if let Some(all) = &operator.rows {
            let [_, groups] = all.groups();
            let outputs = &mut outputs[k * groups..(k + 1) * groups];
            let [q, dq] = taylor.orders(k);
            all.multiply(simd, q, dq, (k + 1) as f64 / taylor.width, rows, outputs);
        }
    }

    /// The laws, and their forces; where contacts are coupled, as far as these follow from lower orders of N.
    #[inline(always)]
    fn laws<S: Lanes>(&mut self, simd: S, operator: &LawOperator, k: usize) {
        let Self { taylor, contacts, convolutions, outputs, .. } = self;
        let coupled = operator.response.is_some();
        let rows = outputs.as_flattened();
        let rows = rows[k * rows.len() / COEFFICIENTS..].as_chunks::<2>().0;
        for (pair, convolutions) in convolutions.iter_mut().enumerate() {
            let middle: [f64; GROUP] = pulp::cast(convolutions.middle(simd, k));
            let (mut left, mut right) = ([0.0; GROUP], [0.0; GROUP]);
            for place in 0..SHARING {
                let i = pair * SHARING + place;
                let Some(Sliding { series, normal, force, at_origin, .. }) = contacts.get_mut(i)
                else {
                    break;
                };
                let one = &operator.contacts[i];
                // The slip speed, and the normal force without those of laws.
                let [mut slip, mut of_normal] = match operator.rows {
                    Some(_) => rows[i],
                    None => [
                        -one.sign * taylor.coefficient(&one.slip, k),
                        taylor.coefficient(&one.normal, k),
                    ],
                };
                if k == 0 {
                    slip -= one.sign * one.slip.constant;
                    of_normal += *at_origin;
                }
                let (excess, of_law) = series.extend(&one.law, k, slip, middle[2 * place]);
                normal[k] = of_normal;
                [left[2 * place], right[2 * place]] = of_law;
                [left[2 * place + 1], right[2 * place + 1]] = [excess, of_normal];
                // The law of this order is known last.
                let known = if coupled { 0.0 } else { series.excess[0] * of_normal };
                let sum = (middle[2 * place + 1] + known) + excess * normal[0];
                force[k] = if k == 0 { known } else { sum };
            }
            convolutions.set(k, group(left), group(right));
        }
    }

    /// The forces of laws of coupled contacts, and the normal forces that they led to.
    #[inline(always)]
    fn coupled_forces(&mut self, k: usize) {
        let Self { contacts, convolutions, .. } = self;
        for (place, Sliding { series, normal, force, .. }) in contacts.iter_mut().enumerate() {
            force[k] += series.excess[0] * normal[k];
            convolutions[place / SHARING].set_normal(k, place % SHARING, normal[k]);
        }
    }

    /// The next order of the state.
    #[inline(always)]
    fn next<S: Lanes>(&mut self, simd: S, scene: &Scene, operator: &LawOperator, k: usize) {
        let Self { taylor, contacts, base, rows, .. } = self;
        if let Some(all) = &operator.rows {
            if k == 0 {
                all.load(base, rows);
            }
            let factor = taylor.width * taylor.width / ((k + 1) * (k + 2)) as f64;
            let forces = |contact: usize| contacts[contact].force[k];
            return all.next(simd, rows, forces, factor, taylor.next_order(k));
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
