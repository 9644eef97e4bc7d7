//! The basis of a status combination: its event functions, and its propagator.

use std::borrow::Cow;
use std::sync::Arc;

use crate::contact::event_function::{EventFunction, event_functions};
use crate::contact::functional::Functional;
use crate::contact::linear_friction::{exhaustions, of_phase};
use crate::error::input::Error;
use crate::modes::quadratic_pencil::Pencil;
use crate::modes::solvers::problem::WELL_CONDITIONED;
use crate::modes::spectrum::modes_of_motion;
use crate::motion::friction::operator::LawOperator;
use crate::motion::friction::series::law_contact::LawOf;
use crate::motion::method::{Method, Wanted};
use crate::motion::method_cost::largest;
use crate::motion::modal::basis::ModalBasis;
use crate::motion::modal::forced::forced_modes;
use crate::motion::panel::Cone;
use crate::motion::taylor::bordered::has_followers;
use crate::motion::taylor::held_modes::HeldModes;
use crate::motion::taylor::operator::TaylorOperator;
use crate::scene::dependent::slaved_coordinates::SlavedCoordinates;
use crate::scene::massless::condensation::Condensed;
use crate::scene::model::Scene;
use crate::scene::partition::Block;
use crate::scene::reduction::reduced_system::Reduced;
use crate::scene::status::{Combination, Status};

/// Part of the usual panels of a linear motion where event functions are sums of squares, which move twice as fast: on the usual ones
/// the products leave out 1e-9 of themselves beyond the last order.
const OF_SQUARES: f64 = 0.5;

/// The method by which a combination is propagated, with its data.
#[derive(Debug)]
pub(crate) enum Propagator {
    Modal(Box<ModalBasis>),
    Taylor(Box<TaylorOperator>),
    /// By Taylor series of its nonlinear equation of motion.
    Law(Box<LawOperator>),
    /// Each block of the scene by its own.
    Blocks(Vec<(Arc<Block>, Arc<CombinationBasis>)>),
}

/// A combination with its event functions and its propagator.
#[derive(Debug)]
pub(crate) struct CombinationBasis {
    pub combination: Combination,
    pub functions: Vec<EventFunction>,
    /// Those of them that stand for contacts in planes.
    pub cones: Vec<Cone>,
    pub propagator: Propagator,
    /// The coordinates that move by themselves, if some coordinates of the scene have no mass.
    pub condensed: Option<Box<Condensed>>,
    /// The scene that moves, where it is not the whole one: what is left of it without the coordinates that follow, unless
    /// series find these by themselves; the scene in the coordinates of the combination, where directions depend on each
    /// other; with dampers in place of laws of friction, where these leave the phase linear.
    pub fitted: Option<Arc<Scene>>,
}

impl CombinationBasis {
    pub fn new(scene: &Scene, combination: &Combination, wanted: Wanted) -> Result<Self, Error> {
        Self::beside(scene, combination, wanted, || None)
    }

    /// The same, with series in the modes with held contacts where there are such modes.
    pub fn beside<'a>(
        scene: &Scene,
        combination: &Combination,
        wanted: Wanted,
        modes: impl Fn() -> Option<&'a Arc<HeldModes>>,
    ) -> Result<Self, Error> {
        scene.check_combination(combination)?;
        let linear = of_phase(scene, combination);
        let is_linear = matches!(linear, Cow::Owned(_));
        let exhaustions = is_linear.then(|| exhaustions(scene, combination));
        let linear = linear.pressed_in(combination);
        let scene = &*linear;
        let condensed = Condensed::new(scene, combination)?.map(Box::new);
        let mut functions = event_functions(scene, combination)?;
        if let Some(exhaustions) = exhaustions {
            functions.extend(exhaustions);
            functions.sort_by_key(|function| function.contact);
        }
        if let Some(condensed) = &condensed {
            pull_back(&mut functions, &condensed.slaved);
        }
        let dependent = scene.has_dependent_directions();
        let fitted =
            (dependent || is_linear).then(|| Arc::new(scene.fitted(combination).into_owned()));
        if let Some(fitted) = fitted.as_ref().filter(|_| dependent) {
            pull_back(&mut functions, &fitted.dependents);
        }
        if condensed.is_some() || dependent {
            let ends = |one: &EventFunction| {
                one.cone.is_some() || !keeps(scene, combination, &one.functional)
            };
            functions.retain(ends);
        }
        let cones = cones_of(scene, &functions);
        let left = || condensed.as_ref().map(|condensed| condensed.scene(scene));
        let series = || {
            // Beside a border they find what follows by themselves.
            if let Some(condensed) = condensed.as_ref().filter(|_| has_followers(scene)) {
                let operator =
                    TaylorOperator::following(scene, combination, &functions, condensed)?;
                return Ok((Propagator::Taylor(Box::new(operator)), None));
            }
            let left = left();
            let mut operator = match modes().filter(|_| left.is_none() && fitted.is_none()) {
                Some(modes) => TaylorOperator::in_modes(modes, combination)?,
                None => {
                    let scene = left.as_deref().unwrap_or(scene);
                    TaylorOperator::new(scene, combination, &functions)?
                }
            };
            if !cones.is_empty() {
                operator.shorten(OF_SQUARES);
            }
            Ok((Propagator::Taylor(Box::new(operator)), left))
        };
        if let Some([contact, _]) = scene.planes().next().filter(|_| scene.contacts_coupled()) {
            let reason = "contacts that mass couples, in a motion; pair nodes with nodes of bodies with lumped mass, let friction act along the velocity alone (plane=False), or reduce the scene by fe.reduce(boundary='lumped')";
            return Err(Error::Plane { contact, reason });
        }
        let law =
            scene.sliding_by_law(combination).next().map(|(contact, _)| LawOf::Contact(contact));
        let mut elements = scene.nonlinear_elements_in(combination);
        let element = || elements.next().map(|(place, _)| LawOf::Element(place));
        let plane =
            || scene.slipping_in_planes(combination).next().map(|[of, _]| LawOf::Contact(of));
        let by_law = law.or_else(element).or_else(plane);
        let large = || {
            let largest = largest(scene);
            scene.size > largest && scene.free(combination) > largest
        };
        let (propagator, left) = if let Some(of) = by_law {
            if wanted == Wanted::Modes {
                let combination = combination.to_string();
                return Err(match of {
                    LawOf::Contact(contact) | LawOf::Deflection(contact) => {
                        Error::NonlinearPhase { combination, contact }
                    }
                    LawOf::Element(place) => {
                        let element = scene.element_name(place);
                        Error::NonlinearElement { combination, element }
                    }
                });
            }
            let left = left();
            let scene = left.as_deref().unwrap_or(scene);
            let operator = LawOperator::new(scene, combination, &functions)?;
            (Propagator::Law(Box::new(operator)), left)
        } else if let Some(cone) = cones.first().filter(|_| wanted == Wanted::Modes) {
            let contact = functions[cone.parts[0].0].contact;
            return Err(Error::Plane { contact, reason: "method='modal'; use 'auto'" });
        } else if wanted == Wanted::Series
            || !cones.is_empty()
            || wanted == Wanted::SoundModes && large()
        {
            series()?
        } else {
            let left = left();
            let scene = left.as_deref().unwrap_or(scene);
            let reduced = Reduced::new(scene, combination)?;
            let modes = match &scene.drive {
                Some(drive) => forced_modes(scene.bare(), drive, &reduced),
                None => {
                    let own = reduced.scene(scene);
                    let pencil = Pencil::new(own, combination, &reduced.reduction);
                    modes_of_motion(&pencil)
                }
            };
            let (modes, condition) = match modes {
                Err(Error::Eigenvalues { .. }) if wanted == Wanted::SoundModes => {
                    (Vec::new(), f64::INFINITY)
                }
                modes => {
                    let modes = modes?;
                    let condition = modes.iter().map(|mode| mode.condition).fold(1.0, f64::max);
                    (modes, condition)
                }
            };
            // Modal superposition about an equilibrium loses at most about the square of this in ulp of the motion, 2e-11
            // of it; above it the series is used instead.
            if condition <= WELL_CONDITIONED {
                let own = reduced.scene(scene);
                let basis = ModalBasis::new(own, &reduced, &functions, modes);
                (Propagator::Modal(Box::new(basis)), left)
            } else if wanted == Wanted::SoundModes {
                series()?
            } else {
                return Err(Error::DefectiveModes {
                    method: "modal",
                    combination: combination.to_string(),
                    condition,
                });
            }
        };
        let fitted = left.or(fitted);
        let combination = combination.clone();
        Ok(Self { combination, functions, cones, propagator, condensed, fitted })
    }

    /// The scene that moves.
    pub fn scene<'a>(&'a self, whole: &'a Scene) -> &'a Scene {
        self.fitted.as_deref().unwrap_or(whole)
    }

    /// The same without the coordinates that follow, also where series find these by themselves.
    pub fn left_of(&self, whole: &Scene) -> Option<Arc<Scene>> {
        match (&self.condensed, &self.propagator) {
            (Some(condensed), Propagator::Taylor(operator)) if operator.follows() => {
                Some(condensed.scene(self.scene(whole)))
            }
            _ => self.fitted.clone(),
        }
    }

    /// Places and velocities of coordinates without mass or that are sums of others, from those of the rest.
    #[inline(always)]
    pub fn complete(&self, q: &mut [f64], u: &mut [f64]) {
        let in_blocks = matches!(self.propagator, Propagator::Blocks(_));
        // Of most scenes there is none, which is asked twice per event.
        if in_blocks || self.condensed.is_some() || self.fitted.is_some() {
            self.complete_followers(q, u);
        }
    }

    fn complete_followers(&self, q: &mut [f64], u: &mut [f64]) {
        match (&self.condensed, &self.fitted) {
            (Some(condensed), _) => condensed.complete(q, u),
            (None, Some(fitted)) => fitted.follow(q, u),
            (None, None) => {}
        }
        match &self.propagator {
            Propagator::Blocks(parts) => {
                for (block, basis) in parts.iter().filter(|part| part.1.condensed.is_some()) {
                    let (mut own_q, mut own_u) = (block.gather(q), block.gather(u));
                    basis.complete(&mut own_q, &mut own_u);
                    block.scatter(&own_q, q);
                    block.scatter(&own_u, u);
                }
            }
            Propagator::Modal(_) | Propagator::Taylor(_) | Propagator::Law(_) => {}
        }
    }

    /// The methods by which the combination is propagated, one for each block if the scene is in blocks.
    pub fn methods(&self) -> Vec<Method> {
        match &self.propagator {
            Propagator::Modal(_) => vec![Method::Modal],
            Propagator::Taylor(_) | Propagator::Law(_) => vec![Method::Taylor],
            Propagator::Blocks(parts) => {
                parts.iter().flat_map(|(_, part)| part.methods()).collect()
            }
        }
    }

    /// About how many numbers it holds.
    pub fn numbers(&self) -> usize {
        let terms = self.functions.iter().map(|function| &function.functional);
        let terms = terms.map(|part| part.position.len() + part.velocity.len());
        let propagator = match &self.propagator {
            Propagator::Modal(basis) => basis.numbers(),
            Propagator::Taylor(operator) => operator.numbers(),
            Propagator::Law(operator) => operator.numbers(),
            Propagator::Blocks(parts) => parts.len(),
        };
        let fitted = self.fitted.as_ref().map_or(0, |scene| {
            let matrices = [&scene.mass, &scene.damping, &scene.stiffness];
            // An index stands beside each value.
            2 * matrices.map(|matrix| matrix.entries()).iter().sum::<usize>()
        });
        let condensed = self.condensed.as_ref().map_or(0, |condensed| condensed.numbers());
        propagator + 2 * terms.sum::<usize>() + fitted + condensed
    }

    pub fn is_modal(&self) -> bool {
        match &self.propagator {
            Propagator::Modal(_) => true,
            Propagator::Taylor(_) | Propagator::Law(_) => false,
            Propagator::Blocks(parts) => parts.iter().all(|(_, basis)| basis.is_modal()),
        }
    }
}

/// Event functions where some coordinates follow the others.
fn pull_back(functions: &mut [EventFunction], slaved: &SlavedCoordinates) {
    Functional::pull_back_all(functions.iter_mut().map(|one| &mut one.functional), slaved);
}

/// The event functions of contacts in planes.
fn cones_of(scene: &Scene, functions: &[EventFunction]) -> Vec<Cone> {
    let planes = scene.planes().filter_map(|contacts| {
        let of_plane = |(place, one): (usize, &EventFunction)| {
            let part = one.cone.filter(|_| contacts.contains(&one.contact))?;
            Some((place, part.sign()))
        };
        let parts: Vec<(usize, f64)> = functions.iter().enumerate().filter_map(of_plane).collect();
        (!parts.is_empty()).then_some(Cone { parts })
    });
    planes.collect()
}

/// Whether a combination keeps the value of a functional, so that it ends nothing: all that the functional tells of is held,
/// on sliders that move alike. A node on a dof that another contact holds is at its friction limit for as long.
fn keeps(scene: &Scene, combination: &Combination, functional: &Functional) -> bool {
    let speed = |k: usize| {
        let mut laws = scene.contacts.iter().zip(combination.statuses());
        laws.find_map(|(law, &status)| match k {
            _ if status.is_closed() && k == law.normal => Some(0.0),
            _ if status == Status::Sticking && k == law.tangential => Some(law.slider_speed),
            _ => None,
        })
    };
    let moved = functional.position.iter().map(|&(k, weight)| Some(weight * speed(k)?));
    let moved: Option<Vec<f64>> = moved.collect();
    let held = functional.velocity.iter().all(|&(k, _)| speed(k).is_some());
    moved.filter(|_| held).is_some_and(|moved| {
        let size = moved.iter().map(|part| part.abs()).sum::<f64>();
        moved.iter().sum::<f64>().abs() <= 8.0 * f64::EPSILON * size
    })
}
