//! The equation of motion of a combination in which friction depends on slip speed.
//!
//! Friction at rest is a part of the linear equation of motion, `q'' = A(q, q')`; what the law adds to it is a force along
//! the contact, `+-(mu(|s|) - mu(0)) N`, with N affine in the state.

use crate::contact::event_function::{EventFunction, Functional, reaction};
use crate::error::Error;
use crate::motion::taylor::operator::TaylorOperator;
use crate::scene::FrictionLaw;
use crate::scene::model::Scene;
use crate::scene::status::Combination;

/// Part of the panels of linear phases: the bound of rounding grows by e^(sigma h) over a panel.
const SHARE: f64 = 0.5;

/// A contact that slides by its law.
#[derive(Debug)]
pub(super) struct LawContact {
    pub contact: usize,
    pub law: FrictionLaw,
    pub tangential: usize,
    /// T / (mu N)
    pub sign: f64,
    pub slider_speed: f64,
    pub normal: Functional,
    /// Bounds of the slip velocity and of the normal force per norm of a state, and of the norm per unit of force.
    pub slip_norm: f64,
    pub normal_norm: f64,
    pub force_norm: f64,
}

#[derive(Debug)]
pub(crate) struct LawOperator {
    pub(super) taylor: TaylorOperator,
    pub(super) contacts: Vec<LawContact>,
    /// Terms of the longest sum in one row of the equation.
    pub(super) terms: usize,
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
        if scene.contacts_coupled()
            && let Some((contact, _)) = Self::sliding(scene, combination).next()
        {
            return Err(Error::CoupledFrictionLaw { contact });
        }
        let mut taylor = TaylorOperator::new(scene, combination, functions)?;
        taylor.shorten(SHARE);
        let contacts = Self::sliding(scene, combination).map(|(contact, law)| {
            let own = &scene.contacts[contact];
            let normal = reaction(scene, own.normal);
            let slip = Functional { velocity: vec![(own.tangential, 1.0)], ..Default::default() };
            LawContact {
                contact,
                law: law.clone(),
                tangential: own.tangential,
                sign: combination.statuses()[contact].friction_sign(),
                slider_speed: own.slider_speed,
                slip_norm: taylor.dual_norm(scene, &slip),
                normal_norm: taylor.dual_norm(scene, &normal),
                force_norm: 1.0 / scene.mass.get(own.tangential, own.tangential).sqrt(),
                normal,
            }
        });
        let contacts = contacts.collect();
        let row = |k: usize| scene.stiffness.row(k).count() + scene.damping.row(k).count();
        let terms = 2 * (0..scene.size).map(row).max().unwrap_or(0);
        Ok(Self { taylor, contacts, terms })
    }

    /// About how many numbers it holds.
    pub fn numbers(&self) -> usize {
        let terms = |one: &LawContact| one.normal.position.len() + one.normal.velocity.len();
        self.taylor.numbers() + 2 * self.contacts.iter().map(terms).sum::<usize>()
    }
}
