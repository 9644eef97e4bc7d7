//! The recurrences of a panel, order by order: slip speeds and normal forces, laws, forces, and the next order of the state.

use crate::motion::friction::balances::followed;
use crate::motion::friction::motion::{Coupling, LawMotion, Sliding, TRIALS};
use crate::motion::friction::operator::LawOperator;
use crate::motion::friction::plane::series::Planes;
use crate::motion::friction::series::coefficients::UNIT;
use crate::motion::friction::series::convolutions::{Convolutions, SHARING};
use crate::motion::friction::series::followed_state::Balance;
use crate::motion::friction::series::law_contact::{Flow, LawContact, StateInput};
use crate::motion::friction::series::law_series::LawSeries;
use crate::motion::friction::state_norm::StateNorm;
use crate::motion::taylor::motion::TaylorMotion;
use crate::motion::taylor::rows::Forces;
use crate::numerics::first_root::polynomial::{COEFFICIENTS, DEGREE};
use crate::numerics::simd::{GROUP, Kernel, Lanes};
use crate::scene::friction::law::FrictionLaw;
use crate::scene::model::Scene;

/// How far an order of a slip speed may go, relative to what its law allows: the 29th power of it is within the range of numbers.
const WIDE: f64 = 1e3;

/// Entries of an order of the state that do not count in the next one, relative to the state: all orders together leave out a small
/// part of a unit of rounding.
const LEAST: f64 = UNIT / 1024.0;

/// The laws of a combination and their forces, order by order.
struct Laws<'a> {
    operator: &'a LawOperator,
    contacts: &'a mut [Sliding],
    convolutions: &'a mut [Convolutions],
    coupling: &'a mut Coupling,
}

/// The slip speed and the normal force of an order, from which its laws follow.
trait Given {
    /// One law and its force, from the terms of its two products with lower orders. Gives the factors of both products.
    fn law(
        &mut self,
        index: usize,
        one: &LawContact,
        sliding: &mut Sliding,
        k: usize,
        middle: [f64; 2],
        coupled: bool,
    ) -> [[f64; 2]; 2];
}

/// Dense rows: the coefficients of velocities and places of the order, and normal forces.
struct ByRows<'a> {
    state: [&'a [f64]; 2],
    accelerations: &'a [f64],
    outputs: &'a [f64],
    states: Option<&'a StateNorm>,
    width: f64,
}

impl Given for ByRows<'_> {
    #[inline(always)]
    fn law(
        &mut self,
        index: usize,
        one: &LawContact,
        sliding: &mut Sliding,
        k: usize,
        middle: [f64; 2],
        coupled: bool,
    ) -> [[f64; 2]; 2] {
        let [q, u] = self.state;
        let slip = match one.single {
            Some((place, weight)) => weight * u[place],
            None => -one.sign * one.slip.rate(q, u),
        };
        // Elements come after the contacts, and have no rows.
        let normal = if one.is_element() { 0.0 } else { self.outputs[index] };
        let state = one.state.as_ref().map_or(0.0, |state| state.value.rate(q, u));
        let factors = sliding.step(one, k, [slip, normal, state], middle, coupled);
        if sliding.followed.follows
            && let Some(row) = self.states.and_then(|states| states.state(index))
        {
            let balance = Balance {
                known: self.accelerations[row.coordinate],
                rate: 1.0 / self.width,
                acceleration: row.acceleration,
                deflection: row.deflection,
            };
            let Sliding { followed, series, force, .. } = sliding;
            force[k] = followed.order(k, &balance, &series.excess, force[k]);
        }
        factors
    }
}

impl Given for TaylorMotion {
    #[inline(always)]
    fn law(
        &mut self,
        _: usize,
        one: &LawContact,
        sliding: &mut Sliding,
        k: usize,
        middle: [f64; 2],
        coupled: bool,
    ) -> [[f64; 2]; 2] {
        if let Some(flow) = &one.flow {
            return sliding.flow(self, one, flow, k, middle);
        }
        let slip = -one.sign * self.coefficient(&one.slip, k);
        let normal = self.coefficient(&one.normal, k);
        let state = one.state.as_ref().map_or(0.0, |state| self.coefficient(&state.value, k));
        sliding.step(one, k, [slip, normal, state], middle, coupled)
    }
}

impl Laws<'_> {
    /// The laws of order k and their forces.
    #[inline(always)]
    fn extend<S: Lanes>(&mut self, simd: S, k: usize, given: &mut impl Given) {
        let Self { operator, contacts, convolutions, coupling } = self;
        let response = operator.response.as_ref();
        let mut middle = [0.0; GROUP];
        for (index, (one, sliding)) in operator.contacts.iter().zip(&mut **contacts).enumerate() {
            if index >= operator.paired {
                given.law(index, one, sliding, k, [0.0; 2], response.is_some());
                continue;
            }
            let (pair, place) = (&mut convolutions[index / SHARING], index % SHARING);
            if place == 0 {
                middle = pair.middle(simd, k);
                pair.close(k);
            }
            let middle = [middle[2 * place], middle[2 * place + 1]];
            let factors = given.law(index, one, sliding, k, middle, response.is_some());
            pair.push(place, factors);
        }
        if let Some(response) = response {
            coupling.couple(&response.normal, &operator.contacts, contacts, k);
            let all = operator.contacts.iter().zip(&mut **contacts).enumerate();
            for (place, (one, Sliding { series, normal, force, .. })) in all {
                if !one.is_element() {
                    force[k] += series.excess[0] * normal[k];
                }
                if place < operator.paired {
                    convolutions[place / SHARING].set_normal(place % SHARING, normal[k]);
                }
            }
        }
    }
}

/// The forces of laws, and after them those of planes along both directions of each.
struct Friction<'a> {
    laws: Laws<'a>,
    planes: Planes<'a>,
    /// Of the planes, order by order.
    forces: Vec<[f64; 2]>,
    width: f64,
}

impl Forces for Friction<'_> {
    #[inline(always)]
    fn follow<S: Lanes>(&mut self, simd: S, k: usize, state: [&[f64]; 2], rows: [&[f64]; 2]) {
        let Self { laws, planes, forces, width } = self;
        let [accelerations, outputs] = rows;
        let states = laws.operator.states.as_ref();
        let mut given = ByRows { state, accelerations, outputs, states, width: *width };
        laws.extend(simd, k, &mut given);
        let Laws { operator, contacts, .. } = laws;
        let of_laws = |row: usize| -> f64 {
            let all = operator.contacts.iter().zip(&**contacts).flat_map(|(one, sliding)| {
                let own = one.direction.iter().filter(move |term| term.0 == row);
                own.map(move |term| one.sign * term.1 * sliding.force[k])
            });
            all.sum()
        };
        let all = planes.contacts.iter().zip(&mut *planes.series).zip(forces);
        for ((one, series), force) in all {
            let w = one.coordinates.map(|row| state[1][row]);
            let limit = one.output.map_or(0.0, |place| one.friction * outputs[place])
                + one.pressing(|place| contacts[place].force[k]);
            let reaction = match series.needs_reaction(k) {
                true => [0, 1].map(|i| {
                    let row = one.coordinates[i];
                    one.mass[i] * accelerations[row] + of_laws(row)
                }),
                false => [0.0; 2],
            };
            *force = series.extend(simd, one, k, (limit, [w, reaction]), *width);
        }
    }

    #[inline(always)]
    fn force(&self, place: usize, k: usize) -> f64 {
        match place.checked_sub(self.laws.contacts.len()) {
            None => self.laws.contacts[place].force[k],
            Some(place) => self.forces[place / 2][place % 2],
        }
    }

    #[inline(always)]
    fn velocities(&self, k: usize) -> impl Iterator<Item = (usize, f64)> {
        let Laws { operator, contacts, .. } = &self.laws;
        let all = followed(operator, contacts);
        all.map(move |(row, sliding)| (row.coordinate, sliding.followed.velocity(k + 1)))
    }
}

/// The recurrences of a combination without dense rows.
struct ByMatrices<'a> {
    taylor: &'a mut TaylorMotion,
    base: &'a [f64],
    laws: Laws<'a>,
    planes: Planes<'a>,
    scene: &'a Scene,
}

impl Kernel for ByMatrices<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { taylor, base, mut laws, mut planes, scene } = self;
        for k in 0..COEFFICIENTS {
            laws.extend(simd, k, taylor);
            if k == 0 {
                taylor.force.copy_from_slice(base);
            } else {
                taylor.force.fill(0.0);
            }
            for (one, sliding) in laws.operator.contacts.iter().zip(&*laws.contacts) {
                one.push(sliding.force[k], &mut taylor.force);
            }
            if !planes.contacts.is_empty() {
                let mut load = std::mem::take(&mut taylor.force);
                let force = |place: usize| laws.contacts[place].force[k];
                planes.push(simd, (scene, taylor), k, (&mut load, force));
                taylor.force = load;
            }
            if k == DEGREE {
                break;
            }
            taylor.order(scene, &laws.operator.taylor, k, true);
        }
        taylor.force.copy_from_slice(base);
    }
}

impl LawMotion {
    /// The recurrences of state, slip speed, normal force and law.
    pub(super) fn recur(&mut self, scene: &Scene, operator: &LawOperator) {
        // Panels are narrow beside the rest of the structure where slip in a plane begins or ends.
        let leaves_out = operator.taylor.dense.is_some() && !operator.planes.is_empty();
        let least = match leaves_out {
            true => LEAST * self.taylor.scale_at_start(&operator.taylor),
            false => 0.0,
        };
        self.uncounted = COEFFICIENTS as f64 * least;
        let Self { taylor, base, contacts, planes, coupling, convolutions, unit, .. } = self;
        convolutions.iter_mut().for_each(Convolutions::clear);
        let laws = Laws { operator, contacts, convolutions, coupling };
        match &operator.taylor.dense {
            Some(rows) => {
                let forces = vec![[0.0; 2]; operator.planes.len()];
                let planes = Planes { contacts: &operator.planes, series: planes };
                let friction = Friction { laws, planes, forces, width: taylor.width };
                let rows = (&operator.taylor, rows);
                unit.run(taylor.orders_by_rows(rows, 0..COEFFICIENTS, (true, friction), least));
            }
            None => {
                let planes = Planes { contacts: &operator.planes, series: planes };
                unit.run(ByMatrices { taylor, base, laws, planes, scene });
            }
        }
        self.convolutions.iter_mut().for_each(|all| all.close(COEFFICIENTS));
        for (one, series) in operator.planes.iter().zip(&mut self.planes) {
            series.beyond = self.taylor.displacement(&one.limit, COEFFICIENTS).abs();
        }
        for (one, sliding) in operator.contacts.iter().zip(&mut self.contacts) {
            sliding.beyond = self.taylor.displacement(&one.normal, COEFFICIENTS).abs();
            let beyond =
                |state: &StateInput| self.taylor.displacement(&state.value, COEFFICIENTS).abs();
            sliding.state_beyond = one.state.as_ref().map_or(0.0, beyond);
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
            let of_slip = |law: &FrictionLaw, series: &LawSeries| {
                let reach = series.reach(law);
                match series.range() <= WIDE * reach {
                    true => 1.0,
                    false => within(&series.slip, reach),
                }
            };
            let laws = operator.contacts.iter().zip(&self.contacts);
            let laws = laws.filter(|of| !of.1.fades);
            let part = laws.fold(1.0, |part: f64, (one, Sliding { series, state, .. })| {
                let of_slip = of_slip(&one.law, series);
                let of_state = match one.state {
                    Some(_) => within(state, series.reach_of_state()),
                    None => 1.0,
                };
                part.min(of_slip).min(of_state)
            });
            let planes = operator.planes.iter().zip(&self.planes);
            let part = planes.fold(part, |part, (one, series)| {
                let of_speed = series.law_of_speed(one).map_or(1.0, |(law, own)| of_slip(law, own));
                part.min(series.part()).min(of_speed)
            });
            if !(part > 0.0 && part < 1.0) {
                break;
            }
            self.taylor.begin_within(part);
        }
    }
}

/// The part of a panel on which no order of a series goes far beyond a distance.
fn within(series: &[f64; COEFFICIENTS], reach: f64) -> f64 {
    // The orders after the first large one follow from it.
    let far = (1..COEFFICIENTS).find(|&k| series[k].abs() > WIDE * reach);
    far.map_or(1.0, |k| (reach / series[k].abs()).powf(1.0 / k as f64))
}

impl Sliding {
    /// Coefficients of order k of the law and its force, from those of slip velocity, normal force and state and the terms of the
    /// two products with lower orders. Gives the factors of both products.
    #[inline(always)]
    fn step(
        &mut self,
        one: &LawContact,
        k: usize,
        [mut slip, mut of_normal, mut of_state]: [f64; 3],
        middle: [f64; 2],
        coupled: bool,
    ) -> [[f64; 2]; 2] {
        let Self { series, state, normal, force, at_origin, slip_at_origin, .. } = self;
        let Self { state_at_origin, fades, .. } = self;
        if k == 0 {
            slip -= one.sign * slip_at_origin[0];
            of_normal += *at_origin;
            of_state += state_at_origin[0];
        }
        if *fades {
            (normal[k], state[k]) = (of_normal, of_state);
            (force[k], series.excess[k]) = (0.0, 0.0);
            return [[0.0; 2]; 2];
        }
        let (excess, [left, right]) = series.extend(&one.law, k, [slip, of_state], middle[0]);
        (normal[k], state[k]) = (of_normal, of_state);
        if one.is_bare() {
            // No normal force multiplies it.
            (force[k], series.excess[k]) = (excess, 0.0);
            return [[0.0; 2]; 2];
        }
        let known = if k == 0 { 0.0 } else { excess.mul_add(normal[0], middle[1]) };
        // The normal force of this order is known last; that of an element is known.
        let waits = coupled && !one.is_element();
        force[k] = if waits { known } else { series.excess[0].mul_add(of_normal, known) };
        [[left, excess], [right, of_normal]]
    }

    /// The same where slip has no mass: the force is known from its balance, and the slip speed follows.
    fn flow(
        &mut self,
        taylor: &mut TaylorMotion,
        one: &LawContact,
        flow: &Flow,
        k: usize,
        middle: [f64; 2],
    ) -> [[f64; 2]; 2] {
        let Self { series, normal, force, at_origin, friction_at_origin, .. } = self;
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
            let (without, _) = series.extend(&one.law, k, [0.0; 2], middle[0]);
            let slip = ((force[k] - known) / normal[0] - without) / series.slope(&one.law);
            (slip, middle[0])
        };
        let (excess, [left, right]) = series.extend(&one.law, k, [slip, 0.0], of_lower);
        let still = if k == 0 { flow.slider_speed } else { 0.0 };
        taylor.flow(flow.coordinate, k, still - one.sign * slip);
        [[left, excess], [right, normal[k]]]
    }
}
