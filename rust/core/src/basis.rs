//! What is known of a status combination, found when it is first reached and kept.

use std::collections::HashMap;
use std::sync::Arc;

use crate::blocks::Block;
use crate::cost::largest;
use crate::error::Error;
use crate::event::EventFunction;
use crate::motion::{ModalBasis, TaylorOperator};
use crate::pencil::Pencil;
use crate::reduction::Reduced;
use crate::scene::Scene;
use crate::simulation::Method;
use crate::spectrum::{Vectors, spectrum};
use crate::status::{Combination, Status};

/// Modal superposition about an equilibrium loses at most about the square of this in ulp of the motion, 2e-11 of it;
/// above it the series is used instead.
const CONDITION_LIMIT: f64 = 300.0;
/// Numbers in the combinations kept per scene: 4096 of 20 coordinates, about 64 MB of modes.
const KEPT: usize = 4096 * 20 * 20;

/// How a combination is to be propagated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Wanted {
    /// By modes, or not at all.
    Modes,
    /// By modes unless they are ill-conditioned or too many.
    SoundModes,
    /// By Taylor series.
    Series,
}

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
    pub functions: Vec<EventFunction>,
    pub propagator: Propagator,
}

impl CombinationBasis {
    fn new(scene: &Scene, combination: &Combination, wanted: Wanted) -> Result<Self, Error> {
        if !scene.blocks().is_empty() {
            let part = |block: &Arc<Block>| block.scene.basis(&block.statuses(combination), wanted);
            let bases = scene.blocks().iter().map(part).collect::<Result<Vec<_>, Error>>()?;
            let bases = bases.into_iter().map(|(basis, _)| basis);
            return Ok(Self::of_blocks(scene, combination.clone(), bases));
        }
        let functions = scene.event_functions(combination);
        let series = || {
            let operator = TaylorOperator::new(scene, combination, &functions)?;
            Ok(Propagator::Taylor(Box::new(operator)))
        };
        let large = scene.free(combination) > largest(scene);
        let propagator = if wanted == Wanted::Series || wanted == Wanted::SoundModes && large {
            series()?
        } else {
            let reduced = Reduced::new(scene, combination)?;
            let modes = spectrum(&Pencil::new(scene, &reduced), Vectors::Refined)?;
            let condition = modes.iter().map(|mode| mode.condition).fold(1.0, f64::max);
            if condition <= CONDITION_LIMIT {
                Propagator::Modal(Box::new(ModalBasis::new(scene, &reduced, &functions, modes)))
            } else if wanted == Wanted::SoundModes {
                series()?
            } else {
                return Err(Error::DefectiveModes {
                    method: "modal",
                    combination: combination.clone(),
                    condition,
                });
            }
        };
        Ok(Self { combination: combination.clone(), functions, propagator })
    }

    /// Of a scene in blocks, from a basis for each.
    pub fn of_blocks(
        scene: &Scene,
        combination: Combination,
        bases: impl Iterator<Item = Arc<CombinationBasis>>,
    ) -> Self {
        Self {
            functions: scene.event_functions(&combination),
            propagator: Propagator::Blocks(scene.blocks().iter().cloned().zip(bases).collect()),
            combination,
        }
    }

    /// By what it is propagated, block by block if the scene is in blocks.
    pub fn methods(&self) -> Vec<Method> {
        match &self.propagator {
            Propagator::Modal(_) => vec![Method::Modal],
            Propagator::Taylor(_) => vec![Method::Taylor],
            Propagator::Blocks(parts) => {
                parts.iter().flat_map(|(_, part)| part.methods()).collect()
            }
        }
    }

    pub fn is_modal(&self) -> bool {
        match &self.propagator {
            Propagator::Modal(_) => true,
            Propagator::Taylor(_) => false,
            Propagator::Blocks(parts) => parts.iter().all(|(_, basis)| basis.is_modal()),
        }
    }
}

/// The combinations met so far.
#[derive(Debug, Default)]
pub(crate) struct BasisCache {
    known: HashMap<(Combination, Wanted), Arc<CombinationBasis>>,
    /// Sum of the squares of their sizes.
    numbers: usize,
}

impl Scene {
    /// Coordinates that a combination leaves free.
    pub(crate) fn free(&self, combination: &Combination) -> usize {
        let held = |status: &Status| {
            usize::from(status.is_closed()) + usize::from(*status == Status::Sticking)
        };
        self.size - combination.statuses().iter().map(held).sum::<usize>()
    }

    /// The basis of a combination, and whether it had to be computed.
    pub(crate) fn basis(
        &self,
        combination: &Combination,
        wanted: Wanted,
    ) -> Result<(Arc<CombinationBasis>, bool), Error> {
        let key = (combination.clone(), wanted);
        // A poisoned lock only means that another thread stopped between two complete entries.
        let lock = || self.bases.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if let Some(basis) = lock().known.get(&key) {
            return Ok((Arc::clone(basis), false));
        }
        let basis = Arc::new(CombinationBasis::new(self, combination, wanted)?);
        let mut cache = lock();
        let numbers = if basis.is_modal() { self.size * self.size } else { self.size };
        if cache.numbers + numbers > KEPT {
            *cache = BasisCache::default();
        }
        cache.numbers += numbers;
        cache.known.insert(key, Arc::clone(&basis));
        Ok((basis, true))
    }

    /// Combinations kept from earlier runs.
    pub fn remembered(&self) -> usize {
        self.bases.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).known.len()
    }

    /// Drops the combinations kept; motions computed from them keep their own.
    pub fn forget(&self) {
        *self.bases.lock().unwrap_or_else(|poisoned| poisoned.into_inner()) = BasisCache::default();
    }
}
