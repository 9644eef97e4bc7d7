//! The equation of motion of a combination in which friction depends on slip speed.
//!
//! Friction at rest is a part of the linear equation of motion, `q'' = A(q, q')`; what the law adds to it is a force along
//! the contact, `+-(mu(|s|) - mu(0)) N`. N is affine in the state, and where contacts are coupled, in these forces.

use nalgebra::DMatrix;

use crate::contact::event_function::{
    EventFunction, Functional, contact_forces, friction_response, reaction, slip_velocity,
    undetermined,
};
use crate::contact::event_kind::EventKind;
use crate::error::Error;
use crate::motion::taylor::operator::TaylorOperator;
use crate::scene::friction::law::FrictionLaw;
use crate::scene::model::Scene;
use crate::scene::status::Combination;

/// Part of the panels of linear phases: the bound of rounding grows by e^(sigma h) over a panel.
const SHARE: f64 = 0.8;

/// A contact that slides by its law.
#[derive(Debug)]
pub(super) struct LawContact {
    pub contact: usize,
    pub law: FrictionLaw,
    /// T / (mu N)
    pub sign: f64,
    /// The slip velocity, and N without what laws add.
    pub slip: Functional,
    pub normal: Functional,
    /// `L' t` over the kept coordinates.
    pub direction: Vec<(usize, f64)>,
    /// Bounds of the slip velocity and of the normal force per norm of a state, and of the norm per unit of force.
    pub slip_norm: f64,
    pub normal_norm: f64,
    pub force_norm: f64,
}

#[derive(Debug)]
pub(crate) struct LawOperator {
    pub(super) taylor: TaylorOperator,
    pub(super) contacts: Vec<LawContact>,
    /// What the force that the law of each adds, along its slip, adds to the normal forces of all of them and to the event
    /// functions; none where contacts are not coupled.
    pub(super) response: Option<Response>,
    /// Terms of the longest sum in one row of the equation.
    pub(super) terms: usize,
}

#[derive(Debug)]
pub(super) struct Response {
    pub normal: DMatrix<f64>,
    pub functions: DMatrix<f64>,
}

impl LawOperator {
    /// The contacts of a combination that slide by a law.
    pub fn sliding<'a>(
        scene: &'a Scene,
        combination: &'a Combination,
    ) -> impl Iterator<Item = (usize, &'a FrictionLaw)> {
        let statuses = combination.statuses().iter().enumerate();
        let sliding = statuses.filter(|(_, status)| status.is_sliding());
        sliding.filter_map(|(contact, _)| Some((contact, scene.friction_law(contact)?)))
    }

    pub fn new(
        scene: &Scene,
        combination: &Combination,
        functions: &[EventFunction],
    ) -> Result<Self, Error> {
        if let Some(&contact) = undetermined(scene, combination).first() {
            return Err(Error::UndeterminedFrictionLaw { contact });
        }
        let mut taylor = TaylorOperator::new(scene, combination, functions)?;
        taylor.shorten(SHARE);
        let forces = scene.contacts_coupled().then(|| contact_forces(scene, combination));
        let own = taylor.equation.scene(scene);
        let over_own = |functional: Functional| match own.dependents.is_empty() {
            true => functional,
            false => functional.substituted(own),
        };
        let reduction = &taylor.equation.reduction;
        let contacts = Self::sliding(scene, combination).map(|(contact, law)| {
            let mut along = vec![0.0; own.size];
            let tangential = scene.contacts[contact].tangential;
            own.terms_of(tangential).iter().for_each(|&(k, weight)| along[k] = weight);
            let row = |i: usize| reduction.sources(i).map(|(k, factor)| factor * along[k]).sum();
            let rows = reduction.kept.iter().enumerate().map(|(i, &k)| (k, row(i)));
            let direction = rows.filter(|entry: &(usize, f64)| entry.1 != 0.0).collect();
            let slip = over_own(slip_velocity(scene, contact));
            let normal = over_own(match &forces {
                Some(forces) => forces[contact].1.clone(),
                None => reaction(scene, scene.contacts[contact].normal),
            });
            let mut acceleration = vec![0.0; own.size];
            taylor.equation.accelerate(&mut along, &mut acceleration);
            LawContact {
                contact,
                law: law.clone(),
                sign: combination.statuses()[contact].friction_sign(),
                direction,
                slip_norm: taylor.dual_norm(own, &slip),
                normal_norm: taylor.dual_norm(own, &normal),
                force_norm: taylor.norm_of_velocity(own, &acceleration),
                slip,
                normal,
            }
        });
        let contacts: Vec<LawContact> = contacts.collect();
        let response = friction_response(scene, combination).map(|all| Response {
            normal: DMatrix::from_fn(contacts.len(), contacts.len(), |i, j| {
                all[(2 * contacts[i].contact + 1, contacts[j].contact)]
            }),
            functions: DMatrix::from_fn(functions.len(), contacts.len(), |i, j| {
                let EventFunction { contact, trigger, .. } = functions[i];
                let force = |row: usize| all[(2 * contact + row, contacts[j].contact)];
                let limit = scene.contacts[contact].static_friction;
                match trigger {
                    EventKind::Release => force(1),
                    EventKind::SlipPositive => limit * force(1) - force(0),
                    EventKind::SlipNegative => limit * force(1) + force(0),
                    _ => 0.0,
                }
            }),
        });
        let row = |k: usize| own.stiffness.row(k).count() + own.damping.row(k).count();
        let merged = reduction.merges.len() + 2;
        let terms = merged * (0..own.size).map(row).max().unwrap_or(0);
        Ok(Self { taylor, contacts, response, terms })
    }

    /// About how many numbers it holds.
    pub fn numbers(&self) -> usize {
        let terms = |one: &LawContact| one.normal.position.len() + one.normal.velocity.len();
        self.taylor.numbers() + 2 * self.contacts.iter().map(terms).sum::<usize>()
    }
}
