//! The combinations that a run has met, and the bases by which their phases are propagated.

use std::collections::HashMap;
use std::sync::Arc;

use crate::error::input::Error;
use crate::motion::combination_basis::CombinationBasis;
use crate::motion::method::{Method, Wanted};
use crate::motion::method_cost::{MODES_AT_ONCE, Novelty, Rental};
use crate::motion::propagators::Propagators;
use crate::scene::status::{Combination, Status};
use crate::transient::run_state::RunState;
use crate::transient::trajectory::model::Trajectory;
use crate::transient::trajectory::used_bases::{HeldBases, UsedBasis};

/// Combinations that a run looks up by comparing statuses; those met later by their hash.
const COMPARED: usize = 24;

/// A combination that a run has met.
#[derive(Clone, Copy)]
struct Known {
    /// Place of its basis in those of the trajectory.
    basis: usize,
    rental: Option<Rental>,
}

/// The combinations that a run has met, by place.
pub(crate) struct MetCombinations<'a> {
    propagators: &'a Propagators,
    method: Method,
    known: Vec<Known>,
    /// Places of those from `COMPARED` on.
    places: HashMap<Combination, usize>,
    novelty: Novelty,
    held: HeldBases,
}

impl<'a> MetCombinations<'a> {
    /// None yet.
    pub fn new(propagators: &'a Propagators, method: Method) -> Self {
        Self {
            propagators,
            method,
            known: Vec::new(),
            places: HashMap::new(),
            novelty: Novelty::default(),
            held: HeldBases::default(),
        }
    }

    /// The place of a basis among those of the trajectory.
    pub fn basis(&self, place: usize) -> usize {
        self.known[place].basis
    }

    /// The basis of a combination, from its place.
    pub fn held(&mut self, trajectory: &Trajectory, place: usize) -> &Arc<CombinationBasis> {
        self.held.get(&trajectory.bases, self.propagators, self.known[place].basis)
    }

    /// Number of panels that a phase may take, by the time at which the next of them begins, s.
    pub fn allowed_panels(
        &self,
        place: usize,
        state: &RunState<'_>,
    ) -> impl Fn(f64) -> usize + use<> {
        let (rental, novelty, part) = (self.known[place].rental, self.novelty, state.part());
        move |time| rental.map_or(usize::MAX, |rental| rental.panels(novelty, part(time)))
    }

    /// Counts the panels of a phase.
    pub fn add_panels(&mut self, place: usize, panels: usize) {
        if let Some(rental) = &mut self.known[place].rental {
            rental.add(panels);
        }
    }

    /// Whether the modes of a combination are worth their cost by now.
    pub fn is_over(&self, place: usize, state: &RunState<'_>) -> bool {
        let rental = self.known[place].rental;
        rental.is_some_and(|rental| rental.is_over(self.novelty, state.part()(state.time.seconds)))
    }

    /// The place of a combination, with the basis that the phase to come is to have.
    pub fn meet(&mut self, state: &mut RunState<'_>, statuses: &[Status]) -> Result<usize, Error> {
        let bases = &state.trajectory.bases;
        let compared = self.known.iter().take(COMPARED);
        let place = compared
            .map(|known| bases[known.basis].combination.statuses())
            .position(|known| known == statuses)
            .or_else(|| match self.places.is_empty() {
                true => None,
                false => self.places.get(&Combination::new(statuses.to_vec())).copied(),
            });
        self.novelty.count(place.is_none());
        if let Some(place) = place {
            if self.is_over(place, state) {
                let combination = bases[self.known[place].basis].combination.clone();
                let basis = self.find(&mut state.trajectory, &combination, Wanted::SoundModes)?;
                self.known[place] = Known { basis, rental: None };
            }
            return Ok(place);
        }
        let combination = Combination::new(statuses.to_vec());
        let may_rent = self.method == Method::Auto && state.scene.size > MODES_AT_ONCE;
        let free = may_rent.then(|| state.scene.free(&combination));
        let renting = free.filter(|&free| free > MODES_AT_ONCE);
        let wanted =
            if renting.is_some() { Wanted::Series } else { self.method.for_repeated_use() };
        let basis = self.find(&mut state.trajectory, &combination, wanted)?;
        let rental = renting.map(|free| Rental::new(self.propagators.cost(free)));
        let place = self.known.len();
        self.known.push(Known { basis, rental });
        if place >= COMPARED {
            self.places.insert(combination, place);
        }
        Ok(place)
    }

    /// The place of a basis among those of the trajectory, which gains it.
    fn find(
        &mut self,
        trajectory: &mut Trajectory,
        combination: &Combination,
        wanted: Wanted,
    ) -> Result<usize, Error> {
        let (basis, computed) = self.propagators.basis(combination, wanted)?;
        trajectory.counters.combinations += usize::from(computed);
        trajectory.bases.push(UsedBasis::new(&basis, wanted));
        let place = trajectory.bases.len() - 1;
        self.held.hold(place, basis);
        Ok(place)
    }
}
