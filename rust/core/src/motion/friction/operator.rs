//! The equation of motion of a combination in which friction depends on slip speed.
//!
//! Friction at rest is a part of the linear equation of motion, `q'' = A(q, q')`; what the law adds to it is a force along
//! the contact, `+-(mu(|s|) - mu(0)) N`. N is affine in the state, and where contacts are coupled, in these forces.

use std::collections::BTreeSet;
use std::f64::consts::SQRT_2;

use nalgebra::{DMatrix, DVector};

use crate::contact::contact_forces::{contact_forces, free_forces, reaction, response};
use crate::contact::event_function::{EventFunction, slip_velocity};
use crate::contact::functional::Functional;
use crate::error::input::Error;
use crate::linalg::dense::solve;
use crate::motion::friction::plane::contact::PlaneContact;
use crate::motion::friction::series::elastic_plane::{Product, products};
use crate::motion::friction::series::law_contact::{Flow, LawContact, LawOf, StateInput};
use crate::motion::friction::state_norm::StateNorm;
use crate::motion::taylor::operator::TaylorOperator;
use crate::motion::taylor::rows::Rows;
use crate::scene::elements::element::ElementKind;
use crate::scene::friction::contact_state::{ContactState, StateContact};
use crate::scene::friction::elastic_plane::ElasticPlane;
use crate::scene::friction::law::FrictionLaw;
use crate::scene::model::Scene;
use crate::scene::status::Combination;

/// Part of the panels of linear phases: the bound of rounding grows by e^(sigma h) over a panel.
const SHARE: f64 = 0.8;
/// Sum of normal forces in balance with each other, relative to the largest, that is rounding.
const BALANCED: f64 = 1e-9;

#[derive(Debug)]
pub(crate) struct LawOperator {
    pub(crate) taylor: TaylorOperator,
    /// Contacts, then elements by tables, and then those by formulas.
    pub(super) contacts: Vec<LawContact>,
    /// The first ones, whose forces are products of series.
    pub(super) paired: usize,
    /// Contacts that slip in a plane.
    pub(super) planes: Vec<PlaneContact>,
    /// What the force that the law of each adds, along its slip, adds to the normal forces of all of them and to the event
    /// functions; none where contacts are not coupled.
    pub(super) response: Option<Response>,
    /// Where dense rows give the coefficients of each event function.
    pub(super) sources: Vec<Source>,
    /// Terms of the longest sum in one row of the equation.
    pub(super) terms: usize,
    /// The rows on which each contact acts, as the first of those that act on the same ones; None where rows overlap in part.
    pub(super) groups: Option<Vec<usize>>,
    /// Where bristles relax, contacts are apart, and nothing else is nonlinear.
    pub(super) states: Option<StateNorm>,
}

/// Where the coefficients of an event function are.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Source {
    /// In one of the rows below those of q''.
    Row(usize),
    /// In the slip speed of one of the contacts that slide by their laws.
    Slip(usize),
    /// In those of a coordinate.
    Coordinate,
}

#[derive(Debug)]
pub(super) struct Response {
    pub normal: DMatrix<f64>,
    pub functions: DMatrix<f64>,
}

impl LawOperator {
    pub fn new(
        scene: &Scene,
        combination: &Combination,
        functions: &[EventFunction],
    ) -> Result<Self, Error> {
        let mut taylor = TaylorOperator::new(scene, combination, functions)?;
        taylor.shorten(SHARE);
        let forces = scene.contacts_coupled().then(|| contact_forces(scene, combination));
        let own = taylor.equation.scene(scene);
        let over_own = |functional: Functional| match own.dependents.is_empty() {
            true => functional,
            false => functional.pulled_back(&own.dependents),
        };
        let reduction = &taylor.equation.reduction;
        // `L' d` over the kept coordinates, and the norm of the acceleration that a newton along d causes.
        let driven = |terms: &[(usize, f64)]| {
            let mut along = vec![0.0; own.size];
            terms.iter().for_each(|&(k, weight)| along[k] += weight);
            let row = |i: usize| reduction.sources(i).map(|(k, factor)| factor * along[k]).sum();
            let rows = reduction.kept.iter().enumerate().map(|(i, &k)| (k, row(i)));
            let direction: Vec<(usize, f64)> =
                rows.filter(|entry: &(usize, f64)| entry.1 != 0.0).collect();
            let mut acceleration = vec![0.0; own.size];
            taylor.equation.accelerate(&mut along, &mut acceleration);
            let norm = taylor.norm_of_velocity(own, &acceleration);
            (direction, norm)
        };
        let built =
            |of, law, sign: f64, along: &[(usize, f64)], [slip, normal]: [Functional; 2]| {
                let (direction, force_norm) = driven(along);
                LawContact {
                    of,
                    law,
                    sign,
                    flow: None,
                    state: None,
                    direction,
                    slip_norm: taylor.dual_norm(own, &slip),
                    normal_norm: taylor.dual_norm(own, &normal),
                    force_norm,
                    single: match slip.single() {
                        Some((1, place, weight)) => Some((place, -sign * weight)),
                        _ => None,
                    },
                    slip,
                    normal,
                }
            };
        let norm_of = |functional: &Functional| taylor.dual_norm(own, functional);
        let with_state = |contact: usize, own: &StateContact, law: &FrictionLaw| {
            let status = combination.statuses()[contact];
            let sign = status.friction_sign();
            let slip = slip_velocity(scene, contact);
            let state = Functional { velocity: vec![own.as_velocity()], ..Functional::default() };
            let of = LawOf::Contact(contact);
            let along = |sign: f64, terms: &[(usize, f64)]| -> Vec<(usize, f64)> {
                terms.iter().map(|&(k, weight)| (k, sign * weight)).collect()
            };
            match &own.law {
                // A law of the slip speed times the deflection, or one of the deflection times the slip speed.
                ContactState::Bristles(numbers) => match numbers.hysteresis {
                    None => {
                        let terms = along(sign, &own.directions());
                        vec![built(of, law.clone(), sign, &terms, [slip, state])]
                    }
                    Some(hysteresis) => {
                        let law = numbers.loop_in(status, hysteresis);
                        let factors = [state, slip.scaled(-sign)];
                        let terms = along(-1.0, &own.directions());
                        vec![built(LawOf::Deflection(contact), law, -1.0, &terms, factors)]
                    }
                },
                ContactState::Formulas(formulas) => {
                    let one = |law: FrictionLaw, term, normal: Option<usize>| {
                        let pressing = match normal {
                            Some(normal) => reaction(scene, normal),
                            None => Functional { constant: 1.0, ..Functional::default() },
                        };
                        LawContact {
                            state: Some(StateInput {
                                norm: norm_of(&state),
                                value: state.clone(),
                                pressed: normal.is_some(),
                                fading: None,
                            }),
                            ..built(of, law, sign, &along(sign, &[term]), [slip.clone(), pressing])
                        }
                    };
                    let [force, rate] = formulas.in_status(status).laws();
                    let [by_force, by_rate] = own.directions();
                    vec![one(force, by_force, own.normal), one(rate, by_rate, None)]
                }
            }
        };
        let in_plane = |contact: usize, plane: &ElasticPlane<'_>| {
            let [_, (row, weight)] = plane.directions[0].directions();
            let of = LawOf::Deflection(contact);
            let built = |Product { law, factors, pressed }| LawContact {
                state: pressed.map(|(value, fading)| StateInput {
                    norm: norm_of(&value),
                    value,
                    pressed: true,
                    fading: Some(fading),
                }),
                ..built(of, law, -1.0, &[(row, -weight)], factors)
            };
            let all = products(scene, combination, [contact, plane.beside], plane)?;
            Ok(all.into_iter().map(built).collect())
        };
        let of_contact = |(contact, law): (usize, &FrictionLaw)| -> Result<Vec<LawContact>, Error> {
            if let Some(plane) = scene.elastic_plane(contact) {
                return in_plane(contact, &plane);
            }
            if let Some(own) = scene.state_of(contact) {
                return Ok(with_state(contact, own, law));
            }
            let tangential = scene.contacts[contact].tangential;
            let slip = over_own(slip_velocity(scene, contact));
            let normal = over_own(match &forces {
                Some(forces) => forces[contact].1.clone(),
                None => reaction(scene, scene.contacts[contact].normal),
            });
            let sign = combination.statuses()[contact].friction_sign();
            let flow = scene.creeps(contact).then(|| {
                let friction = reaction(scene, tangential).scaled(sign);
                Flow {
                    coordinate: tangential,
                    slider_speed: scene.contacts[contact].slider_speed,
                    spring: own.stiffness.get(tangential, tangential).max(0.0),
                    friction_norm: taylor.dual_norm(own, &friction),
                    friction,
                    weight: taylor.weight_of(tangential),
                }
            });
            let along = own.terms_of(tangential);
            let of = LawOf::Contact(contact);
            Ok(vec![LawContact { flow, ..built(of, law.clone(), sign, &along, [slip, normal]) }])
        };
        let contacts: Result<Vec<_>, Error> =
            scene.sliding_by_law(combination).map(of_contact).collect();
        let elements = scene.nonlinear_elements_in(combination).map(|(place, one)| {
            let mut slip = Functional { constant: -one.offset, ..Functional::default() };
            match one.kind {
                ElementKind::Spring => slip.position.clone_from(&one.direction),
                ElementKind::Damper => slip.velocity.clone_from(&one.direction),
            }
            let normal = Functional { constant: 1.0, ..Functional::default() };
            let of = LawOf::Element(place);
            built(of, one.excess.clone(), -1.0, &one.direction, [slip, normal])
        });
        let contacts: Vec<LawContact> = contacts?.into_iter().flatten().chain(elements).collect();
        if let Some(contact) =
            free_forces(scene, combination).and_then(|free| moved_by(&free, &contacts))
        {
            return Err(Error::UndeterminedFrictionLaw { contact });
        }
        let of_forces = response(scene, combination);
        let pressing_by = |contact: usize, friction: f64| -> Vec<(usize, f64)> {
            let row =
                of_forces.iter().flat_map(|all| all.row(2 * contact + 1).into_iter().copied());
            let terms = row.enumerate().map(|(place, by_force)| (place, friction * by_force));
            terms.filter(|term| term.1 != 0.0).collect()
        };
        let response = of_forces.as_ref().map(|all| Response {
            normal: DMatrix::from_fn(contacts.len(), contacts.len(), |i, j| match contacts[i].of {
                // What multiplies the forces of other contacts with states is no normal force.
                LawOf::Contact(contact) if contacts[i].multiplies_normal(scene) => {
                    all[(2 * contact + 1, j)]
                }
                _ => 0.0,
            }),
            functions: DMatrix::from_fn(functions.len(), contacts.len(), |i, j| {
                functions[i].response(all, j)
            }),
        });
        let row = |k: usize| own.stiffness.row(k).count() + own.damping.row(k).count();
        let merged = reduction.merges.len() + 2;
        let terms = merged * (0..own.size).map(row).max().unwrap_or(0);
        let along = |contact: usize| {
            let tangential = scene.contacts[contact].tangential;
            let (direction, norm) = driven(&[(tangential, 1.0)]);
            (tangential, direction, norm)
        };
        let pressing = |&[first, _]: &[usize; 2]| reaction(scene, scene.contacts[first].normal);
        let slipping: Vec<[usize; 2]> = scene.slipping_in_planes(combination).collect();
        let pressed: Vec<Functional> = slipping.iter().map(pressing).collect();
        let (outputs, of_planes, sources) = outputs(&contacts, &pressed, functions);
        let mut along_planes = Vec::new();
        let mut planes = Vec::with_capacity(slipping.len());
        for ((&[first, second], normal), output) in slipping.iter().zip(&pressed).zip(of_planes) {
            let (along, across) = (along(first), along(second));
            let coordinates = [along.0, across.0];
            let of_velocity = |k: usize| {
                let velocity = Functional { velocity: vec![(k, 1.0)], ..Functional::default() };
                taylor.dual_norm(own, &velocity)
            };
            let slip_norm = of_velocity(along.0);
            let friction = scene.contacts[first].friction;
            let limit = normal.scaled(friction);
            planes.push(PlaneContact {
                contacts: [first, second],
                coordinates,
                slider: [first, second].map(|contact| scene.contacts[contact].slider_speed),
                limit_norm: taylor.dual_norm(own, &limit),
                limit,
                friction,
                law: scene.friction_law(first).cloned(),
                pressed_by: pressing_by(first, friction),
                output,
                mass: coordinates.map(|k| own.mass.get(k, k)),
                force_norm: along.2.max(across.2),
                slip_norm,
                speed_norm: slip_norm.max(of_velocity(across.0)),
            });
            along_planes.extend([along.1, across.1]);
        }
        if taylor.dense.is_some() {
            let of = |one: &LawContact| {
                one.direction.iter().map(|&(k, weight)| (k, one.sign * weight)).collect()
            };
            let forces: Vec<_> = contacts.iter().map(of).chain(along_planes).collect();
            let moving = taylor.equation.moving();
            taylor.dense = Rows::new(own, reduction, moving, &outputs, &forces);
        }
        let alone = contacts.iter().rev().take_while(|one| one.is_alone()).count();
        let paired = contacts.len() - alone;
        let sliding = || contacts.iter().filter(|one| !one.is_element());
        let of_rows =
            |one: &LawContact| one.direction.iter().map(|term| term.0).collect::<Vec<_>>();
        let rows: Vec<Vec<usize>> = sliding().map(of_rows).collect();
        let first = |own: &Vec<usize>| rows.iter().position(|other| other == own).unwrap_or(0);
        let groups: Vec<usize> = rows.iter().map(first).collect();
        let each = groups.iter().enumerate().filter(|(place, first)| place == *first);
        let of_groups = || each.clone().flat_map(|(place, _)| &rows[place]);
        let apart = of_groups().collect::<BTreeSet<_>>().len() == of_groups().count();
        let alone = apart
            && groups.iter().enumerate().all(|(place, first)| place == *first)
            && planes.is_empty()
            && response.is_none();
        let groups = apart.then_some(groups);
        let states = alone.then(|| StateNorm::new([scene, own], &taylor, &contacts)).flatten();
        Ok(Self { taylor, contacts, paired, planes, response, sources, terms, groups, states })
    }

    /// The widest panel relative to that of the linear motion, whose norm counts what bristles take back.
    pub fn widest(&self) -> f64 {
        let of = |states: &StateNorm| (self.taylor.norm() / states.others()).max(1.0);
        self.states.as_ref().map_or(1.0, of)
    }

    /// What bounds of matrices grow by in the norm with both velocities of a plane as one entry, where the norm is the largest one.
    pub fn widened(&self, scene: &Scene) -> f64 {
        if self.planes.is_empty() || scene.coupled_mass.is_some() { 1.0 } else { SQRT_2 }
    }

    /// Where slip has no mass: the rate at which its coordinate follows the others, 1/s, for a slope of the friction force over
    /// the slip speed, N s/m.
    pub fn relaxation(&self, one: &LawContact, slope: f64) -> f64 {
        let of = |flow: &Flow| {
            let pressed = one.law.value(0.0) * one.normal_norm;
            flow.weight * (flow.friction_norm + pressed) / slope
        };
        one.flow.as_ref().map_or(0.0, of)
    }

    /// Where slip has no mass: how velocities that follow from forces change along rates of the places,
    /// `mu'(|s|) N |s|' = R' - mu N'`.
    pub fn accelerate_flows(&self, q: &[f64], rates: &[f64], acceleration: &mut [f64]) {
        for one in &self.contacts {
            let Some(flow) = &one.flow else { continue };
            let still = [];
            let [pressed, friction] = [&one.normal, &flow.friction].map(|of| of.value(q, &still));
            let at_rest = one.law.value(0.0);
            let speed = one.law.speed_at((friction - at_rest * pressed) / pressed);
            if !(pressed > 0.0) {
                continue;
            }
            let change = flow.friction.rate(rates, &still)
                - one.law.value(speed) * one.normal.rate(rates, &still);
            acceleration[flow.coordinate] = -one.sign * change / (one.law.slope(speed) * pressed);
        }
    }

    /// Adds forces of the laws to a residual.
    pub fn push(&self, forces: &[f64], residual: &mut [f64]) {
        self.contacts.iter().zip(forces).for_each(|(one, force)| one.push(*force, residual));
    }

    /// Forces of the laws in a state, over the coordinates of the equation.
    pub fn forces(&self, q: &[f64], u: &[f64]) -> Vec<f64> {
        let excess: Vec<f64> = self.contacts.iter().map(|one| one.excess(q, u)).collect();
        let normals = self.normals(&excess, q, u);
        let forces = self.contacts.iter().zip(excess.iter().zip(normals));
        forces.map(|(one, (excess, n))| excess * n + one.value_with_state(q, u)).collect()
    }

    /// N of the contacts that slide by a law.
    fn normals(&self, excess: &[f64], q: &[f64], u: &[f64]) -> Vec<f64> {
        let given = self.contacts.iter().map(|one| one.normal.value(q, u));
        let given: Vec<f64> = match &self.response {
            Some(Response { normal, .. }) => {
                let with_state = self.contacts.iter().map(|one| one.value_with_state(q, u));
                let pressed = normal * DVector::from_iterator(self.contacts.len(), with_state);
                given.zip(&pressed).map(|(a, b)| a + b).collect()
            }
            None => given.collect(),
        };
        self.coupled(excess, given)
    }

    /// `(1 - H e) N = given`
    fn coupled(&self, excess: &[f64], given: Vec<f64>) -> Vec<f64> {
        let Some(Response { normal, .. }) = &self.response else { return given };
        let matrix = DMatrix::from_fn(excess.len(), excess.len(), |i, j| {
            f64::from(u8::from(i == j)) - normal[(i, j)] * excess[j]
        });
        solve(matrix, &given)
    }

    pub fn has_planes(&self) -> bool {
        !self.planes.is_empty()
    }

    /// Forces of laws where elements press contacts that slip in planes.
    fn pressing_planes(&self, forces: impl Fn(&Self) -> Vec<f64>) -> Vec<f64> {
        let are_pressed = self.planes.iter().any(|one| !one.pressed_by.is_empty());
        if are_pressed { forces(self) } else { Vec::new() }
    }

    /// Adds the friction in planes to a residual, which has no friction yet.
    pub fn push_in_planes(&self, q: &[f64], u: &[f64], residual: &mut [f64]) {
        let forces = self.pressing_planes(|all| all.forces(q, u));
        for one in &self.planes {
            let limit = one.limit.value(q, u) + one.pressing(|place| forces[place]);
            let force = one.friction(limit, u, one.coordinates.map(|row| residual[row]));
            one.coordinates.iter().zip(force).for_each(|(&row, part)| residual[row] += part);
        }
    }

    /// How it changes along rates (q', q'').
    pub fn push_rates_in_planes(
        &self,
        state: [&[f64]; 2],
        rates: [&[f64]; 2],
        residual: &mut [f64],
    ) {
        let ([q, u], [dq, du]) = (state, rates);
        let forces = self.pressing_planes(|all| all.forces(q, u));
        let changes = self.pressing_planes(|all| all.force_rates(state, rates));
        for one in &self.planes {
            let limit = one.limit.value(q, u) + one.pressing(|place| forces[place]);
            let rate = one.limit.rate(dq, du) + one.pressing(|place| changes[place]);
            let force = one.friction_rate([limit, rate], [u, du]);
            one.coordinates.iter().zip(force).for_each(|(&row, part)| residual[row] += part);
        }
    }

    /// How these forces change along a direction (dq, dq').
    pub fn force_rates(&self, [q, u]: [&[f64]; 2], [dq, du]: [&[f64]; 2]) -> Vec<f64> {
        let excess: Vec<f64> = self.contacts.iter().map(|one| one.excess(q, u)).collect();
        let normals = self.normals(&excess, q, u);
        let by_slip: Vec<f64> = self
            .contacts
            .iter()
            .zip(&normals)
            .map(|(one, normal)| {
                let faster = -one.sign * one.slip.rate(dq, du);
                if let Some(StateInput { value, pressed, .. }) = &one.state {
                    let (_, [by_slip, by_state]) = one.formula_at(q, u);
                    let change = by_slip * faster + by_state * value.rate(dq, du);
                    return if *pressed { change * normal } else { change };
                }
                one.law.slope(one.speed(q, u)) * faster * normal
            })
            .collect();
        let given = self.contacts.iter().map(|one| one.normal.rate(dq, du));
        let given: Vec<f64> = match &self.response {
            Some(Response { normal, .. }) => {
                let pressed = normal * DVector::from_column_slice(&by_slip);
                given.zip(&pressed).map(|(a, b)| a + b).collect()
            }
            None => given.collect(),
        };
        let pressed = self.coupled(&excess, given);
        let terms = by_slip.iter().zip(excess.iter().zip(&pressed));
        terms.map(|(by_slip, (excess, dn))| by_slip + excess * dn).collect()
    }

    /// About how many numbers it holds.
    pub fn numbers(&self) -> usize {
        let terms = |one: &LawContact| one.normal.position.len() + one.normal.velocity.len();
        self.taylor.numbers() + 2 * self.contacts.iter().map(terms).sum::<usize>()
    }
}

/// The rows that a combination needs beside those of q'': normal forces of the contacts first, of planes where they change with their
/// places, and event functions of several coordinates.
fn outputs<'a>(
    contacts: &'a [LawContact],
    pressed: &'a [Functional],
    functions: &'a [EventFunction],
) -> (Vec<&'a Functional>, Vec<Option<usize>>, Vec<Source>) {
    // The normal force of an element is 1.
    let laws = contacts.iter().filter(|one| !one.is_element());
    let mut functionals: Vec<&Functional> = laws.map(|one| &one.normal).collect();
    let of_planes = pressed.iter().map(|normal| {
        let changes = !(normal.position.is_empty() && normal.velocity.is_empty());
        changes.then(|| {
            functionals.push(normal);
            functionals.len() - 1
        })
    });
    let of_planes = of_planes.collect();
    let mut source = |EventFunction { functional, .. }: &'a EventFunction| {
        let is_slip = |one: &LawContact| one.slip.scaled(-one.sign) == *functional;
        let known = functionals.iter().position(|&known| known == functional);
        match (known, contacts.iter().position(is_slip)) {
            (Some(place), _) => Source::Row(place),
            (None, Some(contact)) => Source::Slip(contact),
            (None, None) if functional.single().is_some() => Source::Coordinate,
            (None, None) => {
                functionals.push(functional);
                Source::Row(functionals.len() - 1)
            }
        }
    };
    let sources = functions.iter().map(&mut source).collect();
    (functionals, of_planes, sources)
}

/// A contact whose law makes the motion depend on forces that nothing determines, (T, N) of all contacts by column.
///
/// Normal forces z that move nothing under friction at rest bring `sum (mu_i(|s_i|) - mu_i(0)) z_i t_i` besides. Contacts
/// that slip alike by the same law share their factor and t: z moves nothing if its sum over each such group is zero, as it is
/// under a rigid pad.
fn moved_by(free: &DMatrix<f64>, contacts: &[LawContact]) -> Option<usize> {
    let contact_of = |one: &LawContact| match one.of {
        LawOf::Contact(contact) => Some(contact),
        _ => None,
    };
    let moves = |one: &LawContact| {
        let alike = contacts.iter().filter(|o| o.law == one.law && o.slip.is_equal_to(&one.slip));
        let rows: Vec<usize> = alike.filter_map(contact_of).map(|other| 2 * other + 1).collect();
        free.column_iter().any(|z| rows.iter().map(|&row| z[row]).sum::<f64>().abs() > BALANCED)
    };
    contacts.iter().filter(|one| moves(one)).find_map(contact_of)
}
