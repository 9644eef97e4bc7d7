//! What is known of a status combination, found when it is first reached and kept.

use std::collections::HashMap;
use std::sync::Arc;

use crate::blocks::Block;
use crate::error::Error;
use crate::event::EventFunction;
use crate::motion::{ModalBasis, TaylorOperator};
use crate::pencil::Pencil;
use crate::reduction::Reduced;
use crate::scene::Scene;
use crate::simulation::Method;
use crate::spectrum::{Vectors, spectrum};
use crate::status::Combination;

/// Modal superposition loses about this many ulp; above it the series is used instead.
const CONDITION_LIMIT: f64 = 300.0;
/// Above this many free coordinates a decomposition per combination costs more than the series it saves.
const MODAL_SIZE: usize = 60;
/// Combinations kept per scene, about 64 MB of modes at 20 dofs.
const KEPT_COMBINATIONS: usize = 4096;

/// How a combination is propagated.
#[derive(Debug)]
pub(crate) enum Propagator {
    Modal(Box<ModalBasis>),
    Taylor(Box<TaylorOperator>),
    /// Each block of the scene by its own.
    Blocks(Vec<(Arc<Block>, Arc<CombinationBasis>)>),
}

/// A combination with its event functions and its propagator.
#[derive(Debug)]
pub(crate) struct CombinationBasis {
    pub combination: Combination,
    /// What was asked for when it was made.
    pub method: Method,
    pub functions: Vec<EventFunction>,
    pub propagator: Propagator,
}

impl CombinationBasis {
    fn new(scene: &Scene, combination: &Combination, method: Method) -> Result<Self, Error> {
        let functions = scene.event_functions(combination);
        if !scene.blocks().is_empty() {
            let part = |block: &Arc<Block>| {
                let (basis, _) = block.scene.basis(&block.statuses(combination), method)?;
                Ok((Arc::clone(block), basis))
            };
            let parts = scene.blocks().iter().map(part).collect::<Result<Vec<_>, Error>>()?;
            let propagator = Propagator::Blocks(parts);
            return Ok(Self { combination: combination.clone(), method, functions, propagator });
        }
        let taylor = || TaylorOperator::new(scene, combination, &functions).map(Box::new);
        let closed = combination.statuses().iter().filter(|status| status.is_closed()).count();
        let propagator = match method {
            Method::Taylor => Propagator::Taylor(taylor()?),
            Method::Auto if scene.size - closed > MODAL_SIZE => Propagator::Taylor(taylor()?),
            Method::Auto | Method::Modal => {
                let reduced = Reduced::new(scene, combination)?;
                let modes = spectrum(&Pencil::new(scene, &reduced), Vectors::Refined)?;
                let condition = modes.iter().map(|mode| mode.condition).fold(1.0, f64::max);
                if condition <= CONDITION_LIMIT {
                    Propagator::Modal(Box::new(ModalBasis::new(&reduced, &functions, modes)))
                } else if method == Method::Auto {
                    Propagator::Taylor(taylor()?)
                } else {
                    return Err(Error::DefectiveModes {
                        method: "modal",
                        combination: combination.clone(),
                        condition,
                    });
                }
            }
        };
        Ok(Self { combination: combination.clone(), method, functions, propagator })
    }

    pub fn is_modal(&self) -> bool {
        match &self.propagator {
            Propagator::Modal(_) => true,
            Propagator::Taylor(_) => false,
            Propagator::Blocks(parts) => parts.iter().all(|(_, basis)| basis.is_modal()),
        }
    }
}

/// The combinations met so far, by method.
#[derive(Debug, Default)]
pub(crate) struct BasisCache {
    known: HashMap<(Combination, Method), Arc<CombinationBasis>>,
}

impl Scene {
    /// The basis of a combination, and whether it had to be computed.
    pub(crate) fn basis(
        &self,
        combination: &Combination,
        method: Method,
    ) -> Result<(Arc<CombinationBasis>, bool), Error> {
        let key = (combination.clone(), method);
        // A poisoned lock only means that another thread stopped between two complete entries.
        let lock = || self.bases.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if let Some(basis) = lock().known.get(&key) {
            return Ok((Arc::clone(basis), false));
        }
        let basis = Arc::new(CombinationBasis::new(self, combination, method)?);
        let mut cache = lock();
        if cache.known.len() >= KEPT_COMBINATIONS {
            cache.known.clear();
        }
        cache.known.insert(key, Arc::clone(&basis));
        Ok((basis, true))
    }

    /// Combinations kept from earlier runs.
    pub fn remembered(&self) -> usize {
        self.bases.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).known.len()
    }

    /// Drops the combinations kept; motions computed from them keep their own.
    pub fn forget(&self) {
        self.bases.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).known = HashMap::new();
    }
}
