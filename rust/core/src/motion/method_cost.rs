//! The work on a combination by modes and by Taylor series: the rule by which `Method::Auto` chooses.
//!
//! Modes must be computed before they are used, and nobody knows how often a combination will return. So Taylor series,
//! which need no preparation, begin. Let e be their additional work so far, compared with modal phases, as a part of the work
//! on the modes, and f the part of the run that is over, by its duration or by the events that it may have. A combination that
//! goes on as it did so far saves `e (1 - f) / f` by modes in the rest of the run. They are computed once this reaches their
//! price and e reaches a share s: ski rental with a prediction (Purohit, Svitkina, Kumar, NeurIPS 2018). If the
//! combination returns evenly, the work is at most 1 + s times that of the better method. Whatever happens, e never passes 2, and
//! the work is at most 3 times that of modes from the start and `1 + 1 / s` times that of series. Work is counted and not
//! measured, so a run is the same on every machine.
//!
//! A combination that has come often need not come again. If nearly every event leads to a new combination, as between many
//! contacts, modes are computed only for combinations that return more often than others: the larger the share of changes
//! that lead to a new combination, the longer the rule waits.

use crate::modes::spectrum::REFINED_SIZE;
use crate::motion::method::Wanted;
use crate::motion::taylor::bordered::border_of;
use crate::motion::taylor::rows::Rows;
use crate::numerics::first_root::polynomial::COEFFICIENTS;
use crate::scene::inertia::border::Border;
use crate::scene::model::Scene;
use crate::scene::status::Combination;

/// Number of free coordinates up to which modes are computed at once: a small scene meets few combinations, each often.
pub(crate) const MODES_AT_ONCE: usize = 8;

/// Additional work of series, as a part of the work on modes, from which modes are computed at the soonest. Smaller favours
/// long runs, larger ones that leave a combination for ever.
const SHARE: f64 = 1.0 / 3.0;
/// The same at the latest, however little of the run is left.
const LATEST: f64 = 2.0;
/// Factor by which the soonest is later if every combination is new.
const CAUTION: f64 = 16.0;
/// Number of changes of combination over which the share of new ones is averaged.
const MEMORY: f64 = 64.0;

/// Work on an entry of dense rows relative to an entry of a sparse product: the vector unit takes eight at a time.
const DENSE_ENTRY: f64 = 0.125;
/// Work on one order of a series where the stiffness has a border: at least, and for each coordinate of the border, with the
/// event functions of its contact.
const BORDER_ORDER: f64 = 55.0;
const BORDER_ROW: f64 = 6.0;
/// Work on an entry of a row of the border, which is used twice.
const BORDER_ENTRY: f64 = 0.04;
/// Cost of one massless coordinate, in rows of the border: its row is multiplied twice, the second time with the result of
/// the first.
const FOLLOWER: f64 = 1.75;
/// Rows whose work is that on the coordinates beside the border.
const OTHER_ROWS: f64 = 7.0;
/// Coordinates up to which modes with held contacts are considered, since nothing interrupts their eigenproblem, and by what
/// factor they must make series quicker.
const LARGEST_HELD: usize = 500;
const GAIN: f64 = 2.0;
/// Work on a panel in these modes relative to that of a reduced model, measured beside the modes of meshes with 110 and 420
/// dofs and two contacts. Mass couples their contacts, so that every force is a sum over all coordinates.
const IN_HELD_MODES: f64 = 2.5;
/// Memory that a basis takes while it is computed, bytes: per stored entry of the matrices, per pair of free coordinates of an
/// eigenproblem with right and left vectors, and of everything else.
const BYTES_PER_ENTRY: usize = 64;
const BYTES_PER_PAIR: usize = 320;
const BYTES_BESIDE: usize = 1 << 22;
/// Number of free coordinates up to which modes are considered: nothing interrupts an eigenproblem, and a larger one
/// would delay Ctrl-C by more than a tenth of a second. If mass couples coordinates, series cost more, and a longer delay
/// is accepted.
pub(crate) fn largest(scene: &Scene) -> usize {
    if scene.mass.is_diagonal() { 200 } else { 500 }
}

/// Memory that a combination takes at most while its basis is computed, bytes: that of the rows of its series, and, by modes,
/// of the eigenproblem of its free coordinates.
pub(crate) fn bytes_of_basis(scene: &Scene, combination: &Combination, wanted: Wanted) -> usize {
    let matrices = [&scene.mass, &scene.damping, &scene.stiffness];
    let entries = matrices.map(|matrix| matrix.entries()).iter().sum::<usize>();
    let directions = 2 * scene.contacts.len();
    let series = BYTES_PER_ENTRY * (entries + directions * directions);
    let free = scene.free(combination);
    let by_modes = match wanted {
        Wanted::Series => false,
        Wanted::Modes => true,
        Wanted::SoundModes => free <= largest(scene),
    };
    BYTES_BESIDE + series + if by_modes { BYTES_PER_PAIR * free * free } else { 0 }
}

/// Whether a run of a coupled scene by [`crate::motion::method::Method::Auto`] is a local march, if it can be: too large for
/// modes, and sparse, so that an event that reaches a part of it costs that part of its work, and no event more than all of it.
pub(crate) fn marches_locally(scene: &Scene) -> bool {
    let is_sparse = || !Rows::are_quicker(scene) && border_of(scene).is_none();
    scene.size > largest(scene) && is_sparse()
}

/// Whether series in the modes with held contacts are quicker than those of a dense scene as it is, so much so that their
/// eigenproblem does not count.
pub(crate) fn pays_held_modes(scene: &Scene) -> bool {
    let n = scene.size;
    let rows = 2 * scene.contacts.len();
    (Rows::are_quicker(scene) || !scene.mass.is_diagonal())
        && n <= LARGEST_HELD
        && Border::is_worth(n, rows)
        && border_of(scene).is_none()
        && work_of_order(scene, n) > GAIN * work_of_border(rows as f64, n)
}

/// Work on one order of a series of a scene with `free` coordinates, in multiplications of a sparse product.
fn work_of_order(scene: &Scene, free: usize) -> f64 {
    if let Some(border) = border_of(scene) {
        let followers = FOLLOWER * border.long_followers() as f64;
        work_of_border(border.coordinates.len() as f64 + followers, scene.size)
    } else if Rows::are_quicker(scene) {
        DENSE_ENTRY * (free * scene.size) as f64
    } else {
        let damping = if scene.proportional.is_none() { scene.damping.entries() } else { 0 };
        let inverse = scene.coupled_mass.as_ref().map_or(0.0, |mass| mass.work());
        (scene.size + scene.stiffness.entries() + damping) as f64 + inverse
    }
}

/// The same where contacts are the border of the stiffness of `size` coordinates.
fn work_of_border(rows: f64, size: usize) -> f64 {
    BORDER_ORDER + BORDER_ROW * rows + BORDER_ENTRY * (rows + OTHER_ROWS) * size as f64
}

/// Work on one combination, in multiplications of a sparse product.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cost {
    /// Computing the modes.
    pub modes: f64,
    /// One panel by Taylor series.
    panel: f64,
    /// A phase by modes. They pass over quiet stretches as a whole, so it depends little on its length.
    phase: f64,
}

impl Cost {
    /// The work on a combination with `free` coordinates. The factors were measured with chains of 1 to 80 subsystems,
    /// and with dense stiffness and coupled masses of 46 to 104 free coordinates. Those of a border are a fit within 10 % to
    /// the instructions of a panel of reduced models with 50 to 200 coordinates and 4 to 20 contacts, by vectors of four,
    /// relative to those of their modes; the part by vectors counts half of it, as with vectors of eight.
    pub fn new(scene: &Scene, free: usize) -> Self {
        let m = free as f64;
        let modes = if free <= REFINED_SIZE {
            250.0 * m.powi(2) + 4.5 * m.powi(3)
        } else if free <= largest(scene) {
            300.0 * m.powi(2) + 0.8 * m.powi(3)
        } else {
            f64::INFINITY
        };
        let panel = COEFFICIENTS as f64 * work_of_order(scene, free);
        Self { modes, panel, phase: 7.0 * m.powi(2) }
    }

    /// The same where the scene is one in its modes with held contacts.
    pub fn in_held_modes(self) -> Self {
        Self { panel: IN_HELD_MODES * self.panel, ..self }
    }
}

/// How many of the last changes of combination led to a new one.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Novelty(f64);

impl Novelty {
    pub fn count(&mut self, is_new: bool) {
        self.0 += (f64::from(u8::from(is_new)) - self.0) / MEMORY;
    }

    /// The factor by which modes wait longer at least.
    fn caution(self) -> f64 {
        1.0 + CAUTION * self.0
    }
}

/// A combination that goes by Taylor series as long as its modes are not worth their price.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rental {
    cost: Cost,
    /// Work of Taylor series beyond that of modal phases.
    excess: f64,
}

impl Rental {
    pub fn new(cost: Cost) -> Self {
        Self { cost, excess: 0.0 }
    }

    /// Counts a phase of so many panels.
    pub fn add(&mut self, panels: usize) {
        self.excess += panels as f64 * self.cost.panel - self.cost.phase;
    }

    /// Whether modes are worth their cost when a part `done` of the run is over.
    pub fn is_over(&self, novelty: Novelty, done: f64) -> bool {
        self.excess >= self.allowed(novelty, done)
    }

    /// Number of panels of one phase after which modes are worth their cost, when a part `done` of the run is over.
    pub fn panels(&self, novelty: Novelty, done: f64) -> usize {
        let left = self.allowed(novelty, done) - self.excess + self.cost.phase;
        // Large numbers are cut off at the largest integer.
        ((left / self.cost.panel).ceil() as usize).max(1)
    }

    /// The work that series may take beyond that of modes.
    fn allowed(&self, novelty: Novelty, done: f64) -> f64 {
        let pays = (done / (1.0 - done).max(f64::MIN_POSITIVE)).min(LATEST);
        pays.max(SHARE * novelty.caution()) * self.cost.modes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rental() -> Rental {
        Rental::new(Cost { modes: 1000.0, panel: 10.0, phase: 15.0 })
    }

    /// The work on so many phases of so many panels each, if after some phases and panels so much of the run is over; and by modes
    /// or series alone.
    fn work(panels: usize, phases: usize, done: impl Fn(usize, usize) -> f64) -> [f64; 3] {
        let mut rental = Some(rental());
        let Cost { modes, panel, phase } = self::rental().cost;
        let (settled, mut work) = (Novelty::default(), 0.0);
        for past in 0..phases {
            if rental.is_some_and(|rental| rental.is_over(settled, done(past, 0))) {
                (rental, work) = (None, work + modes);
            }
            let Some(known) = &mut rental else {
                work += phase;
                continue;
            };
            let is_enough = |used: usize| used >= known.panels(settled, done(past, used));
            let used = (1..panels).find(|&used| is_enough(used)).unwrap_or(panels);
            known.add(used);
            work += used as f64 * panel;
            if used < panels {
                (rental, work) = (None, work + modes + phase);
            }
        }
        [work, modes + phases as f64 * phase, (phases * panels) as f64 * panel]
    }

    /// Whatever the number of phases after which the combination is left for ever, and whatever is taken for the rest.
    #[test]
    fn work_stays_within_the_bounds_of_the_rule() {
        for (panels, percent) in (2..300).flat_map(|panels| [0, 30, 60, 99].map(|p| (panels, p))) {
            let done = f64::from(percent) / 100.0;
            let share = (done / (1.0 - done)).clamp(SHARE, LATEST);
            for phases in [1, 2, 3, 5, 9, 17, 33, 65, 150, 400, 1000] {
                let [work, by_modes, by_series] = self::work(panels, phases, |_, _| done);
                // A panel is not cut.
                assert!(work <= (1.0 + share) * by_modes + 25.0);
                assert!(work <= (1.0 + 1.0 / share) * by_series + 15.0);
            }
        }
    }

    /// A combination that returns evenly until the end of the run.
    #[test]
    fn work_is_near_that_of_the_better_method_if_the_run_goes_on_as_it_did() {
        for (panels, phases) in (2..40).flat_map(|panels| (1..300).map(move |p| (panels, p))) {
            let even = |past, used| (past * panels + used) as f64 / (phases * panels) as f64;
            let [work, by_modes, by_series] = self::work(panels, phases, even);
            // Within one phase.
            let whole = 10.0 * panels as f64 + 15.0;
            assert!(work <= (1.0 + SHARE) * by_modes.min(by_series) + whole);
        }
    }

    #[test]
    fn the_panels_allowed_are_those_after_which_modes_are_worth_it() {
        for begun in [1, 5, 20] {
            let mut rental = rental();
            rental.add(begun);
            for done in [0.0, 0.5, 0.9, 1.0] {
                let [mut one_less, mut enough] = [rental; 2];
                let panels = rental.panels(Novelty::default(), done);
                one_less.add(panels - 1);
                assert!(!one_less.is_over(Novelty::default(), done));
                enough.add(panels);
                assert!(enough.is_over(Novelty::default(), done));
            }
        }
    }

    #[test]
    fn what_modes_do_quicker_than_a_panel_never_pays() {
        let mut rental = Rental::new(Cost { modes: 1000.0, panel: 10.0, phase: 10.0 });
        (0..100_000).for_each(|_| rental.add(1));
        assert!(!rental.is_over(Novelty::default(), 0.0));
    }

    #[test]
    fn modes_wait_where_combinations_are_new() {
        let (mut settled, mut changing) = (Novelty::default(), Novelty::default());
        (0..1000).for_each(|k| settled.count(k < 10));
        (0..1000).for_each(|k| changing.count(k % 4 == 0));
        // Of the last changes a quarter, or none.
        assert!((changing.0 - 0.25).abs() < 2.0 / MEMORY && settled.0 < 1e-6);
        assert!(rental().panels(changing, 0.0) > 4 * rental().panels(settled, 0.0));
        assert_eq!(rental().panels(settled, 0.0), rental().panels(Novelty::default(), 0.0));
    }
}
