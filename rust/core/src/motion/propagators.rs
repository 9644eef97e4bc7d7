//! A scene with the propagators of the combinations that it has met; runs, orbits and searches share them.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock};

use lru::LruCache;

use crate::contact::event_function::event_functions;
use crate::error::input::Error;
use crate::motion::combination_basis::{CombinationBasis, Propagator};
use crate::motion::local::locality::Locality;
use crate::motion::local::reach::Reaches;
use crate::motion::method::Wanted;
use crate::motion::method_cost::{Cost, bytes_of_basis, pays_held_modes};
use crate::motion::taylor::held_modes::HeldModes;
use crate::scene::model::Scene;
use crate::scene::partition::{Block, blocks_of};
use crate::scene::status::Combination;

/// Numbers that the kept combinations may hold in all: 256 MB.
/// When a new one exceeds it, those used longest ago are dropped.
const KEPT: usize = 1 << 25;

/// A scene and the propagators of its combinations, found when a combination is first reached and kept.
#[derive(Debug)]
pub struct Propagators {
    /// As it was given.
    bare: Arc<Scene>,
    /// With the coordinates that carry its loads.
    pub(crate) scene: Arc<Scene>,
    parts: OnceLock<Vec<Part>>,
    locality: OnceLock<Result<Arc<Reaches>, Error>>,
    held: OnceLock<Option<Arc<HeldModes>>>,
    memory: Mutex<Memory>,
}

/// A part of the scene that nothing couples to the others, with propagators of its own.
#[derive(Debug)]
pub(crate) struct Part {
    pub block: Arc<Block>,
    pub propagators: Arc<Propagators>,
}

/// The combinations met so far, those used longest ago at the end.
#[derive(Debug)]
struct Memory {
    known: LruCache<(Combination, Wanted), Arc<CombinationBasis>>,
    /// Sum of their sizes, and how large it may be.
    numbers: usize,
    most: usize,
    /// Every combination ever kept.
    #[cfg(test)]
    ever: Vec<std::sync::Weak<CombinationBasis>>,
}

impl Default for Memory {
    fn default() -> Self {
        Self {
            known: LruCache::unbounded(),
            numbers: 0,
            most: KEPT,
            #[cfg(test)]
            ever: Vec::new(),
        }
    }
}

impl Memory {
    /// Keeps a basis and hands it back; the one that another thread kept before, if there is one.
    fn keep(
        &mut self,
        key: (Combination, Wanted),
        basis: Arc<CombinationBasis>,
    ) -> Arc<CombinationBasis> {
        if let Some(earlier) = self.known.get(&key) {
            return Arc::clone(earlier);
        }
        self.numbers += basis.numbers();
        #[cfg(test)]
        self.ever.push(Arc::downgrade(&basis));
        self.known.put(key, Arc::clone(&basis));
        while self.numbers > self.most && self.known.len() > 1 {
            if let Some((_, oldest)) = self.known.pop_lru() {
                self.numbers -= oldest.numbers();
            }
        }
        basis
    }
}

impl Propagators {
    /// The propagators of a scene, none of them computed yet.
    pub fn new(scene: Arc<Scene>) -> Self {
        Self {
            bare: Arc::clone(&scene),
            scene: Scene::driven(scene),
            parts: OnceLock::new(),
            locality: OnceLock::new(),
            held: OnceLock::new(),
            memory: Mutex::default(),
        }
    }

    /// The scene as it was given, without the coordinates that carry its loads.
    pub fn bare(&self) -> &Arc<Scene> {
        &self.bare
    }

    /// The same with coordinates that carry its loads in time, as motions have it.
    pub fn moving(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Parts that nothing couples; none if all of the scene is one.
    pub(crate) fn parts(&self) -> &[Part] {
        self.parts.get_or_init(|| {
            blocks_of(&self.scene)
                .into_iter()
                .map(|block| Part {
                    propagators: Arc::new(Self::new(Arc::clone(&block.scene))),
                    block: Arc::new(block),
                })
                .collect()
        })
    }

    /// The data of the scene that local marches need.
    pub(crate) fn locality(&self) -> Result<Arc<Reaches>, Error> {
        self.locality
            .get_or_init(|| Locality::new(&self.scene).map(|of| Arc::new(Reaches::new(of))))
            .clone()
    }

    /// The modes of the structure with held contacts, where series are quicker in them.
    fn held_modes(&self) -> Option<&Arc<HeldModes>> {
        let found = || HeldModes::new(&self.scene).map(Arc::new);
        self.held.get_or_init(|| pays_held_modes(&self.scene).then(found).flatten()).as_ref()
    }

    /// The work on a combination with `free` coordinates.
    pub(crate) fn cost(&self, free: usize) -> Cost {
        match self.held_modes() {
            None => Cost::new(&self.scene, free),
            Some(modes) => Cost::new(&modes.scene, free).in_held_modes(),
        }
    }

    /// The basis of a combination, and whether it had to be computed.
    pub(crate) fn basis(
        &self,
        combination: &Combination,
        wanted: Wanted,
    ) -> Result<(Arc<CombinationBasis>, bool), Error> {
        let key = (combination.clone(), wanted);
        if let Some(basis) = self.memory().known.get(&key) {
            return Ok((Arc::clone(basis), false));
        }
        let basis = if self.parts().is_empty() {
            self.check_room(combination, wanted)?;
            CombinationBasis::beside(&self.scene, combination, wanted, || self.held_modes())?
        } else {
            let part =
                |part: &Part| part.propagators.basis(&part.block.statuses(combination), wanted);
            let bases = self.parts().iter().map(part).collect::<Result<Vec<_>, Error>>()?;
            self.of_parts(combination.clone(), bases.into_iter().map(|(basis, _)| basis))?
        };
        Ok((self.memory().keep(key, Arc::new(basis)), true))
    }

    /// Refuses a basis for whose matrices there is no memory: a run can end with its motion so far, but a matrix that cannot be
    /// had in the middle of its computation ends the process.
    fn check_room(&self, combination: &Combination, wanted: Wanted) -> Result<(), Error> {
        let scene = self.held_modes().map_or(&*self.scene, |modes| &modes.scene);
        let bytes = bytes_of_basis(scene, combination, wanted);
        let mut room: Vec<u8> = Vec::new();
        room.try_reserve_exact(bytes).map_err(|_| Error::Memory {
            what: "motion: the matrices by which a combination is propagated",
            size: scene.free(combination),
            remedy: "method='taylor' needs less, and so does a scene reduced to fewer modes",
        })
    }

    /// The basis of a scene in parts, from a basis for each part.
    pub(crate) fn of_parts(
        &self,
        combination: Combination,
        bases: impl Iterator<Item = Arc<CombinationBasis>>,
    ) -> Result<CombinationBasis, Error> {
        let blocks = self.parts().iter().map(|part| Arc::clone(&part.block));
        Ok(CombinationBasis {
            functions: event_functions(&self.scene, &combination)?,
            propagator: Propagator::Blocks(blocks.zip(bases).collect()),
            combination,
            cones: Vec::new(),
            condensed: None,
            fitted: None,
        })
    }

    /// Numbers that the kept combinations may hold in all from now on.
    #[cfg(test)]
    pub(crate) fn keep_at_most(&self, numbers: usize) {
        self.memory().most = numbers;
    }

    /// How many bases were computed, and how many of them are still in memory.
    #[cfg(test)]
    pub(crate) fn computed_and_alive(&self) -> (usize, usize) {
        let ever = &self.memory().ever;
        (ever.len(), ever.iter().filter(|basis| basis.strong_count() > 0).count())
    }

    fn memory(&self) -> MutexGuard<'_, Memory> {
        // A poisoned lock only means that another thread stopped between two complete entries.
        self.memory.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}
