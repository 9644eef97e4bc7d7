//! The recurrences of a panel of at most two contacts and few coordinates, whose rows are one block and whose contacts are
//! not coupled.
//!
//! The general recurrences spend most of their time on finding places; here the newest order stays in registers.

use pulp::cast;

use crate::motion::friction::motion::{LawMotion, Sliding};
use crate::motion::friction::operator::LawOperator;
use crate::motion::friction::series::convolutions::SHARING;
use crate::motion::friction::series::law_contact::LawContact;
use crate::motion::friction::series::rows::{BLOCK, LawRows};
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE};
use crate::numerics::simd::{GROUP, Group, Kernel, Lanes, ZEROS, group, lanes_of, store};

/// Room for the coordinates of a block of rows; a place in it needs no further check.
const ROOM: usize = BLOCK * GROUP;

/// 1 / ((k + 1) (k + 2))
const STEPS: [f64; COEFFICIENTS] = {
    let mut steps = [0.0; COEFFICIENTS];
    let mut k = 0;
    while k < COEFFICIENTS {
        steps[k] = 1.0 / ((k + 1) * (k + 2)) as f64;
        k += 1;
    }
    steps
};

/// What fits: the motion, its operator, the rows and what the slip velocities read, (coordinate, weight).
pub(super) struct Small<'a> {
    motion: &'a mut LawMotion,
    operator: &'a LawOperator,
    rows: &'a LawRows,
    slips: [(usize, f64); SHARING],
}

impl<'a> Small<'a> {
    /// None of a motion that needs the general recurrences.
    pub fn new(motion: &'a mut LawMotion, operator: &'a LawOperator) -> Option<Self> {
        let rows = operator.rows.as_ref().filter(|rows| rows.is_block())?;
        let mut slips = [(0, 0.0); SHARING];
        for (slip, one) in slips.iter_mut().zip(&operator.contacts) {
            let (1, place, weight) = one.slip.single()? else { return None };
            *slip = (place, -one.sign * weight);
        }
        let fits = (1..=SHARING).contains(&operator.contacts.len()) && operator.response.is_none();
        fits.then_some(Self { motion, operator, rows, slips })
    }
}

impl Kernel for Small<'_> {
    /// Whether the contacts fit; if not, the general recurrences are to be used.
    type Output = bool;

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> bool {
        match self.rows.states + 1 {
            2 => self.recur::<2, S>(simd),
            3 => self.recur::<3, S>(simd),
            _ => self.recur::<BLOCK, S>(simd),
        }
    }
}

impl Small<'_> {
    /// With `T` groups of rows, the last one of normal forces and event functions.
    #[inline(always)]
    fn recur<const T: usize, S: Lanes>(self, simd: S) -> bool {
        let Self { motion, operator, rows, slips } = self;
        let LawMotion { taylor, contacts, convolutions, products, base, .. } = motion;
        let ([convolutions], Some(first)) = (&mut convolutions[..], operator.contacts.first())
        else {
            return false;
        };
        let (of_first, of_second) = contacts.split_at_mut(1);
        let (Some(of_first), of_second) = (of_first.first_mut(), of_second.first_mut()) else {
            return false;
        };
        let mut second = operator.contacts.get(1).zip(of_second);
        let (columns, width) = (rows.columns.as_chunks::<T>().0, taylor.width);
        let (of_z, of_u) = columns.split_at(rows.moving.len());
        let of_z = of_z.as_chunks::<GROUP>().0;
        let inverse = 1.0 / width;
        let all = products.room(rows).as_chunks_mut::<T>().0;
        let forces: [[Group; T]; SHARING] = std::array::from_fn(|i| rows.by_force(i));
        // Coefficients of q of the newest order; z and q' of the one in progress.
        let (n, terms) = taylor.orders_from(0);
        let (mut newest_q, mut z, mut u) = ([ZEROS; T], [ZEROS; BLOCK], [ZEROS; BLOCK]);
        for g in 0..T - 1 {
            let first = g * GROUP;
            let lanes = (n - first).min(GROUP);
            newest_q[g] = lanes_of(simd, &terms[n + first..2 * n], lanes);
            u[g] = simd.mul_f64s(simd.splat_f64s(inverse), newest_q[g]);
            let q = lanes_of(simd, &terms[first..n], lanes);
            z[g] = simd.mul_add_f64s(simd.splat_f64s(rows.beta), u[g], q);
        }
        convolutions.clear();
        let mut newest = [ZEROS; 2];
        for (k, found) in all.iter_mut().enumerate().take(COEFFICIENTS) {
            let (mut even, mut odd) = ([ZEROS; T], [ZEROS; T]);
            let velocities: [f64; ROOM] = cast(u);
            for (coordinates, four) in z.iter().zip(of_z).take(T - 1) {
                let x: [f64; GROUP] = cast(*coordinates);
                let [a, b, c, d] = x.map(|x| simd.splat_f64s(x));
                for g in 0..T {
                    even[g] = simd.mul_add_f64s(four[0][g], a, even[g]);
                    odd[g] = simd.mul_add_f64s(four[1][g], b, odd[g]);
                    even[g] = simd.mul_add_f64s(four[2][g], c, even[g]);
                    odd[g] = simd.mul_add_f64s(four[3][g], d, odd[g]);
                }
            }
            for (column, &place) in of_u.iter().zip(&rows.damped) {
                let x = simd.splat_f64s(velocities[place % ROOM]);
                for g in 0..T {
                    even[g] = simd.mul_add_f64s(column[g], x, even[g]);
                }
            }
            for g in 0..T {
                found[g] = simd.add_f64s(even[g], odd[g]);
            }
            if k == 0 {
                rows.load(base, pulp::bytemuck::cast_slice_mut(found));
            }
            let middle: [f64; GROUP] = cast(convolutions.middle(simd, k, newest));
            let normals: [f64; GROUP] = cast(found[T - 1]);
            let velocity = |(place, weight): (usize, f64)| weight * velocities[place % ROOM];
            let of = [velocity(slips[0]), normals[0]];
            let (a, force_a) = of_first.step(first, k, of, [middle[0], middle[1]], false);
            let (b, force_b) = match &mut second {
                Some((one, sliding)) => {
                    let of = [velocity(slips[1]), normals[1]];
                    sliding.step(one, k, of, [middle[2], middle[3]], false)
                }
                None => ([0.0; 4], 0.0),
            };
            if let Some(before) = k.checked_sub(1) {
                convolutions.set(before, newest);
            }
            newest = [group([a[0], a[2], b[0], b[2]]), group([a[1], a[3], b[1], b[3]])];
            if k == DEGREE {
                convolutions.set(k, newest);
                break;
            }
            let [force_a, force_b] = [force_a, force_b].map(|force| simd.splat_f64s(force));
            let factor = simd.splat_f64s(width * width * STEPS[k]);
            let rate = f64::from(k as u32 + 2) * inverse;
            let (by_beta, rate) = (simd.splat_f64s(rows.beta * rate), simd.splat_f64s(rate));
            let next = &mut terms[(k + 2) * n..];
            for g in 0..T - 1 {
                // The forces are known last.
                let [by_a, by_b] = [0, 1].map(|i| simd.mul_f64s(forces[i][g], factor));
                let sum = simd.mul_f64s(found[g], factor);
                let sum = simd.mul_add_f64s(by_b, force_b, simd.mul_add_f64s(by_a, force_a, sum));
                // Lanes beyond the coordinates fall on the order after, which is found later.
                store(sum, &mut next[g * GROUP..]);
                u[g] = simd.mul_f64s(rate, sum);
                z[g] = simd.mul_add_f64s(by_beta, sum, newest_q[g]);
                newest_q[g] = sum;
            }
        }
        true
    }
}

impl Sliding {
    /// One law and its force, from slip velocity and normal force, and the terms of its two products with lower orders. Gives the
    /// factors of both products, and the force, of coupled contacts as far as it follows from lower orders of N.
    #[inline(always)]
    pub(super) fn step(
        &mut self,
        one: &LawContact,
        k: usize,
        [mut slip, mut of_normal]: [f64; 2],
        middle: [f64; 2],
        coupled: bool,
    ) -> ([f64; 4], f64) {
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
        ([left, right, excess, of_normal], force[k])
    }
}
