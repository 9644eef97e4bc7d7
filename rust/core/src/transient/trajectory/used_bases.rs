//! By what the phases of a motion are propagated.
//!
//! A motion between many contacts meets thousands of combinations, and a basis is a matrix or more. So a motion keeps from
//! what each basis is computed again, to the last bit; the propagators keep as many as there is room for.

use std::sync::Arc;

use crate::error::input::{Error, refused};
use crate::motion::combination_basis::CombinationBasis;
use crate::motion::method::{Method, Wanted};
use crate::motion::phase_motion::HELD;
use crate::motion::propagators::{Part, Propagators};
use crate::scene::status::Combination;

/// A combination and how it is propagated.
#[derive(Debug)]
pub(crate) struct UsedBasis {
    pub combination: Combination,
    /// As what its basis is asked for: of each block of the scene, or of a scene in one piece.
    wanted: Vec<Wanted>,
    /// The methods of this basis.
    pub methods: Vec<Method>,
}

impl UsedBasis {
    /// Of a basis that was asked for.
    pub fn new(basis: &CombinationBasis, wanted: Wanted) -> Self {
        let methods = basis.methods();
        let wanted = vec![wanted; methods.len()];
        Self { combination: basis.combination.clone(), wanted, methods }
    }

    /// Of recorded methods; their basis is computed once, since it has to exist.
    pub fn recorded(
        propagators: &Propagators,
        combination: Combination,
        methods: &[Method],
    ) -> Result<Self, Error> {
        propagators.scene.check_combination(&combination)?;
        if methods.is_empty() {
            return Err(refused("bases that do not fit the scene"));
        }
        let wanted = methods.iter().map(|method| method.for_repeated_use()).collect();
        let used = Self { combination, wanted, methods: Vec::new() };
        let methods = used.basis(propagators)?.methods();
        Ok(Self { methods, ..used })
    }

    pub fn is_modal(&self) -> bool {
        self.methods.iter().all(|&method| method == Method::Modal)
    }

    /// The basis of a motion in progress or at hand, computed again unless the propagators keep it.
    pub fn again(&self, propagators: &Propagators) -> Arc<CombinationBasis> {
        let Ok(basis) = self.basis(propagators) else {
            unreachable!("the same scene gave this basis before")
        };
        basis
    }

    fn basis(&self, propagators: &Propagators) -> Result<Arc<CombinationBasis>, Error> {
        let Self { combination, wanted, .. } = self;
        match (propagators.parts(), &wanted[..]) {
            ([], &[wanted]) => Ok(propagators.basis(combination, wanted)?.0),
            // Under laws of friction an orbit is followed in one piece.
            (_, &[wanted]) => {
                Ok(Arc::new(CombinationBasis::new(&propagators.scene, combination, wanted)?))
            }
            (parts, wanted) if parts.len() == wanted.len() => {
                let basis = |(part, &wanted): (&Part, &Wanted)| {
                    part.propagators.basis(&part.block.statuses(combination), wanted)
                };
                let bases: Vec<_> =
                    parts.iter().zip(wanted).map(basis).collect::<Result<_, Error>>()?;
                let bases = bases.into_iter().map(|(basis, _)| basis);
                Ok(Arc::new(propagators.of_parts(combination.clone(), bases)?))
            }
            _ => Err(refused("bases that do not fit the scene")),
        }
    }
}

/// Bases of a motion that are at hand without asking its propagators, which other threads ask too.
#[derive(Debug, Default)]
pub(crate) struct HeldBases {
    /// By their places among those of the motion.
    bases: Vec<Option<Arc<CombinationBasis>>>,
    /// Sum of their sizes.
    numbers: usize,
}

impl HeldBases {
    /// The basis at a place among those of a motion.
    pub fn get(
        &mut self,
        of: &[UsedBasis],
        propagators: &Propagators,
        place: usize,
    ) -> &Arc<CombinationBasis> {
        if !self.bases.get(place).is_some_and(Option::is_some) {
            self.hold(place, of[place].again(propagators));
        }
        self.bases[place].as_ref().expect("a basis that was held just now")
    }

    /// Holds the basis at a place among those of a motion.
    #[cold]
    pub fn hold(&mut self, place: usize, basis: Arc<CombinationBasis>) {
        if place >= self.bases.len() {
            self.bases.resize(place + 1, None);
        }
        if self.numbers > HELD {
            self.bases.fill(None);
            self.numbers = 0;
        }
        self.numbers += basis.numbers();
        self.bases[place] = Some(basis);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::SparseMatrix;
    use crate::scene::{ContactInput, Damping, Direction, Mass, Scene, SceneInput};
    use crate::transient::run_state::Controls;
    use crate::transient::simulate::simulate;
    use crate::transient::trajectory::model::Trajectory;

    const CONTACTS: usize = 12;
    const DOFS: usize = 64;

    /// Masses on a foundation, pressed on belts of different speeds, every one tied to every other one.
    fn many_contacts() -> Arc<Scene> {
        let contact = |c: usize| ContactInput {
            tangential: Some(Direction::Dof(2 * c)),
            normal: Some(Direction::Dof(2 * c + 1)),
            friction: 0.5,
            static_friction: 0.8,
            slider_speed: 0.05 + 0.005 * c as f64,
            restitution: 0.2,
            ..Default::default()
        };
        let stiffness = SparseMatrix::from_rows(DOFS, |row, entries| {
            entries.extend((0..DOFS).map(|k| match k == row {
                true => (k, 2e5 * (1.0 + 0.07 * k as f64)),
                false => (k, 2e3 * ((1 + row * k + row + k) as f64).sin()),
            }));
        });
        let pressed = |k: usize| if k < 2 * CONTACTS && k % 2 == 1 { -60.0 } else { 0.0 };
        let input = SceneInput {
            mass: Mass::Lumped(vec![1.0; DOFS]),
            stiffness,
            damping: Damping::Proportional { mass: 0.0, stiffness: 1e-6 },
            force: (0..DOFS).map(pressed).collect(),
            contacts: (0..CONTACTS).map(contact).collect(),
            ..Default::default()
        };
        Arc::new(Scene::new(input).expect("well-posed"))
    }

    #[test]
    fn a_motion_through_many_combinations_holds_few_bases_and_loses_no_bit() {
        let scene = many_contacts();
        let mut start = scene.sliding_equilibrium().expect("pressed on");
        start.velocity = (0..DOFS).map(|k| if k % 2 == 0 { -0.4 } else { 0.0 }).collect();
        for k in 2 * CONTACTS..DOFS {
            start.velocity[k] = 0.8 * (k as f64).cos();
        }
        let run = |propagators: &Arc<Propagators>| {
            simulate(propagators, &start, 0.2, Method::Modal, Controls::default()).expect("a run")
        };
        let whole = Arc::new(Propagators::new(Arc::clone(&scene)));
        let all = run(&whole);
        let met = all.combinations_met();
        assert!(met > 60, "{met}");
        assert_eq!(whole.computed_and_alive(), (met, met));
        let times: Vec<f64> = (0..=500).rev().map(|k| all.end * f64::from(k) / 500.0).collect();
        let sample = |run: &Trajectory| {
            let sample = run.sample(&times).expect("times within the motion");
            (sample.position, sample.velocity, sample.friction_force)
        };
        let one = whole.basis(&all.bases[0].combination, Wanted::Modes).expect("modes").0.numbers();
        for kept in [0, 10] {
            let bounded = Arc::new(Propagators::new(Arc::clone(&scene)));
            bounded.keep_at_most(kept * one);
            let few = run(&bounded);
            let alive = bounded.computed_and_alive().1;
            // Closed contacts that stick leave 40 coordinates of 64, and a basis of two fifths of the size.
            assert!(alive <= 1 + 5 * kept / 2, "{alive} of {met}");
            let mut records = [&few, &all].map(Trajectory::record);
            records[0].whole.counters = records[1].whole.counters;
            assert_eq!(records[0], records[1]);
            assert_eq!(sample(&few), sample(&all));
            let [record, _] = records;
            let again = Trajectory::from_record(&bounded, record).expect("a motion of the scene");
            assert_eq!(sample(&again), sample(&all));
            assert!(bounded.computed_and_alive().1 <= 1 + 5 * kept / 2);
        }
    }
}
