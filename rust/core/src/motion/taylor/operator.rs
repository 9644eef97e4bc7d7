//! The equation of motion of one combination for Taylor series, and the norm that bounds the terms that they leave out.
//!
//! In mass-weighted coordinates the first-order system has a norm sigma known beforehand; the derivatives from the
//! second on obey the homogeneous system, so what a polynomial of degree D leaves out is at most
//! `|X_D| rho / (1 - rho)` with `rho = sigma h / (D + 1)`.
//!
//! Where mass is diagonal, the norm is the largest entry, and that of a matrix its largest row sum. Where mass couples
//! coordinates, or stiffness couples them through contacts alone, it is that of M, `|x|^2 = x' M x`: bounds of K and C in it
//! are known for the scene as a whole, and a combination multiplies them by what its friction adds.

use std::sync::{Arc, OnceLock};

use crate::contact::event_function::{EventFunction, event_functions};
use crate::contact::functional::Functional;
use crate::error::input::Error;
use crate::linalg::sparse::SparseMatrix;
use crate::motion::panel::rounding;
use crate::motion::row_rounding::RowRounding;
use crate::motion::series::Largest;
use crate::motion::taylor::bordered::{BorderedRows, border_of};
use crate::motion::taylor::function_rows::FunctionRows;
use crate::motion::taylor::held_modes::HeldModes;
use crate::motion::taylor::rows::Rows;
use crate::numerics::first_root::polynomial::COEFFICIENTS;
use crate::scene::equation_of_motion::EquationOfMotion;
use crate::scene::massless::condensation::Condensed;
use crate::scene::model::Scene;
use crate::scene::status::Combination;

/// Number of coordinates up to which rounding is counted row by row.
const ROW_BY_ROW: usize = 64;
/// sigma times width of a panel, before it is shortened to what the series leaves out. Row sums overestimate
/// the fastest mode about twofold, and terms up to e^(sigma h / 2) cancel.
const WIDTH: f64 = 6.0;
/// The same for the norm of M, which overestimates the fastest mode by some percent.
const TIGHT_WIDTH: f64 = 5.0;

/// Roundings of a coefficient beside those of the sum of its row.
const IN_ROW: usize = 16;

/// The equation of motion of one combination, without forming it.
#[derive(Debug)]
pub(crate) struct TaylorOperator {
    pub(crate) equation: EquationOfMotion,
    /// The same equation in a form that is quicker for small scenes.
    pub(crate) dense: Option<Rows>,
    /// In one that is quicker where stiffness couples coordinates through contacts alone.
    pub(super) bordered: Option<BorderedRows>,
    /// Event functions of many coordinates, with either of them.
    pub(super) long: FunctionRows,
    /// Square root of the mass seen by each coordinate, the weights of the norm.
    pub(super) weight: Vec<f64>,
    /// The same of the states, zero of other coordinates.
    pub(super) state_weight: Vec<f64>,
    /// The weights of all coordinates in the rounding of rows, also of those that contacts move: with the mass that the own
    /// spring would swing at omega, no row sees more of one than `omega^2` times its weight.
    row_weight: Vec<f64>,
    /// Largest number of entries that are summed up in a row of the equation.
    entries: usize,
    /// Coordinates that mass couples to others.
    pub(super) coupled: Vec<usize>,
    /// omega of the norm `max(omega |q|, |q'|)` over mass-weighted coordinates.
    pub(super) omega: f64,
    pub(super) width: f64,
    /// Norm of the first-order system.
    sigma: f64,
    /// The coordinates in which the series moves, where they are not those of the scene.
    pub(super) held: Option<InModes>,
    /// Whether the norm is that of M, and not the largest entry.
    norm_is_of_mass: bool,
    /// For each event function the factor from the norm of a state to a bound of its value.
    pub(super) function_norms: Vec<f64>,
    /// For each event function what rounding of the rows leaves in it, found where the norm does not exclude the function.
    row_rounding: Vec<OnceLock<RowRounding>>,
}

/// The modes with held contacts, and the event functions of the combination in them.
#[derive(Debug)]
pub(super) struct InModes {
    pub modes: Arc<HeldModes>,
    pub functions: Vec<EventFunction>,
}

impl TaylorOperator {
    /// The same in the modes of the structure with held contacts.
    pub fn in_modes(modes: &Arc<HeldModes>, combination: &Combination) -> Result<Self, Error> {
        let functions = event_functions(&modes.scene, combination)?;
        let operator = Self::new(&modes.scene, combination, &functions)?;
        let held = Some(InModes { modes: Arc::clone(modes), functions });
        Ok(Self { held, ..operator })
    }

    /// The scene and the event functions in the coordinates of the series, from those of the scene.
    #[inline]
    pub(super) fn inside<'a>(
        &'a self,
        scene: &'a Scene,
        functions: &'a [EventFunction],
    ) -> (&'a Scene, &'a [EventFunction]) {
        match &self.held {
            None => (scene, functions),
            Some(InModes { modes, functions }) => (&modes.scene, functions),
        }
    }

    /// About how many numbers it holds.
    pub fn numbers(&self) -> usize {
        let bordered = self.bordered.as_ref().map_or(0, BorderedRows::numbers);
        self.equation.numbers() + self.long.numbers() + bordered
    }

    pub fn new(
        scene: &Scene,
        combination: &Combination,
        functions: &[EventFunction],
    ) -> Result<Self, Error> {
        Self::beside(scene, combination, functions, None)
    }

    /// The same of a scene whose border has coordinates without mass.
    pub fn following(
        scene: &Scene,
        combination: &Combination,
        functions: &[EventFunction],
        condensed: &Condensed,
    ) -> Result<Self, Error> {
        Self::beside(scene, combination, functions, Some(condensed))
    }

    /// Whether it finds the places of coordinates without mass by itself.
    pub fn follows(&self) -> bool {
        self.bordered.as_ref().is_some_and(BorderedRows::follows)
    }

    fn beside(
        scene: &Scene,
        combination: &Combination,
        functions: &[EventFunction],
        condensed: Option<&Condensed>,
    ) -> Result<Self, Error> {
        let equation = EquationOfMotion::new(scene, combination)?;
        let fitted = equation.fitted.clone();
        let scene = fitted.as_deref().unwrap_or(scene);
        let weight: Vec<f64> = (0..scene.size).map(|k| scene.mass.get(k, k).sqrt()).collect();
        let dense = match equation.creeping() {
            [] => Rows::new(scene, &equation.reduction, equation.moving(), &[], &[]),
            _ => None,
        };
        let bordered = BorderedRows::new(scene, &equation, condensed);
        let beta = border_of(scene).map_or_else(
            || scene.proportional.filter(|_| dense.is_some()).map(|(_, beta)| beta),
            |border| Some(border.beta),
        );
        let long = beta.map(|beta| FunctionRows::new(scene.size, beta, functions));
        let mut operator = Self {
            bordered,
            long: long.unwrap_or_default(),
            equation,
            dense,
            coupled: (0..scene.size)
                .filter(|&k| scene.mass.row(k).any(|entry| entry.0 != k))
                .collect(),
            weight,
            state_weight: Vec::new(),
            row_weight: Vec::new(),
            entries: 0,
            omega: 0.0,
            width: 0.0,
            sigma: 0.0,
            held: None,
            norm_is_of_mass: scene.coupled_mass.is_some(),
            function_norms: Vec::new(),
            row_rounding: (0..functions.len()).map(|_| OnceLock::new()).collect(),
        };
        let (mut stiffness, damping) = operator.norms(scene);
        // omega balances the two blocks; any positive one is valid.
        let balanced =
            |stiffness: f64| if stiffness > 0.0 { stiffness.sqrt() } else { damping.max(1.0) };
        operator.omega = balanced(stiffness);
        if !operator.equation.creeping().is_empty() {
            // Any positive weight is valid as well: with that of the mass which the spring of the coordinate would swing at
            // omega, it counts as much as the others.
            for &k in operator.equation.creeping() {
                let spring = scene.stiffness.get(k, k).abs();
                operator.weight[k] =
                    (if spring > 0.0 { spring } else { 1.0 }).sqrt() / operator.omega;
            }
            stiffness = operator.norms(scene).0;
            operator.omega = balanced(stiffness);
        }
        let sigma = operator.omega + damping;
        operator.width = if scene.coupled_mass.is_some() { TIGHT_WIDTH } else { WIDTH } / sigma;
        operator.sigma = sigma;
        operator.state_weight = vec![0.0; scene.size];
        for &k in &operator.equation.reduction.states {
            operator.state_weight[k] = operator.weight[k];
        }
        operator.row_weight.clone_from(&operator.weight);
        for &(k, _) in &operator.equation.reduction.sticking {
            let spring = scene.stiffness.get(k, k).abs().sqrt() / operator.omega;
            operator.row_weight[k] = operator.weight[k].max(spring);
        }
        let reduction = &operator.equation.reduction;
        let of_row = |i: usize| {
            let sources = reduction.sources(i);
            sources.map(|(row, _)| scene.stiffness.entries_of(row).0.len()).sum::<usize>()
        };
        operator.entries = (0..reduction.kept.len()).map(of_row).max().unwrap_or(0);
        let of = |function: &EventFunction| operator.dual_norm(scene, &function.functional);
        operator.function_norms = functions.iter().map(of).collect();
        Ok(operator)
    }

    /// The factor from the norm of a state to a bound of the value of a functional.
    pub fn dual_norm(&self, scene: &Scene, functional: &Functional) -> f64 {
        let dual = |terms: &[(usize, f64)]| match &scene.coupled_mass {
            Some(mass) => mass.dual_norm(terms),
            // What a sticking contact without mass prescribes leaves nothing out.
            None => terms
                .iter()
                .filter(|&&(k, _)| self.weight[k] > 0.0)
                .map(|&(k, weight)| weight.abs() / self.weight[k])
                .sum(),
        };
        dual(&functional.position) / self.omega + dual(&functional.velocity)
    }

    /// The same of an event function.
    pub fn function_norm(&self, index: usize) -> f64 {
        self.function_norms[index]
    }

    /// Norm of the state whose velocities are given, and whose displacements are zero.
    pub fn norm_of_velocity(&self, scene: &Scene, u: &[f64]) -> f64 {
        let terms = u.iter().enumerate();
        match scene.coupled_mass.is_some() {
            true => terms.map(|(k, v)| v * scene.mass.row_dot(k, u)).sum::<f64>().sqrt(),
            false => terms.map(|(k, v)| self.weight[k] * v.abs()).fold(0.0, f64::max),
        }
    }

    /// The norm per displacement of a coordinate, where mass couples no coordinates.
    pub fn weight_of(&self, coordinate: usize) -> f64 {
        self.omega * self.weight[coordinate]
    }

    /// The norm of a state of q and `rate` times u, where mass couples no coordinates.
    pub fn largest_of<'a>(&'a self, [q, u]: [&'a [f64]; 2], rate: f64) -> Largest<'a> {
        Largest { weight: &self.state_weight, q, u, factors: [self.omega, rate] }
    }

    /// omega of the norm.
    pub fn omega(&self) -> f64 {
        self.omega
    }

    /// Width of a panel before it is shortened to what the series leaves out.
    pub fn width(&self) -> f64 {
        self.width
    }

    /// Makes all panels shorter.
    pub fn shorten(&mut self, factor: f64) {
        self.width *= factor;
    }

    /// What a series of width h leaves out, relative to its last term: `rho / (1 - rho)`.
    pub(super) fn tail(&self, h: f64) -> f64 {
        let rho = self.sigma * h / COEFFICIENTS as f64;
        rho / (1.0 - rho)
    }

    /// What rounding of the rows of the equation leaves in the state on a panel of width h, in the norm, from the sizes of all
    /// coefficients: a coefficient is rounded by a part of the terms that its row sums up, also where these cancel. Where mass
    /// couples coordinates, this counts a single step and is an estimate.
    pub(super) fn rounding(&self, h: f64, sizes: &[[Vec<f64>; 2]; 3], panels: u32) -> f64 {
        let n = self.row_weight.len();
        let [[q0, u0], [q1, u1], [q2, u2]] =
            sizes.each_ref().map(|of| of.each_ref().map(|x| &x[..n]));
        let [mut largest, mut squares] = [0.0, 0.0];
        for (k, weight) in self.row_weight.iter().enumerate() {
            let (q, u) = (self.omega * (q0[k] + q1[k] + q2[k]), u0[k] + u1[k] + u2[k]);
            // `f64::max` looks for NaN, which takes longer; what the series leaves out is infinite then.
            let entry = weight * if q > u { q } else { u };
            largest = if entry > largest { entry } else { largest };
            squares += entry * entry;
        }
        let reach = self.sigma * h;
        let size =
            if self.norm_is_of_mass { reach * squares.sqrt() } else { reach.exp_m1() * largest };
        self.rounding_of_rows(panels) * size
    }

    /// The rounding of a row, relative to the sum of its absolute terms.
    pub(super) fn rounding_of_rows(&self, panels: u32) -> f64 {
        rounding(self.entries + IN_ROW, panels)
    }

    /// What rounding of the rows leaves in an event function, where it is known row by row: with more coordinates its weights
    /// take longer than what they tell apart is worth, and the norm of the state stands for all rows.
    pub(super) fn row_rounding(
        &self,
        scene: &Scene,
        functional: &Functional,
        index: usize,
    ) -> Option<&RowRounding> {
        let reduction = &self.equation.reduction;
        let rows = || RowRounding::new(scene, reduction, functional, self.width);
        let by_rows = !self.norm_is_of_mass && reduction.kept.len() <= ROW_BY_ROW;
        by_rows.then(|| self.row_rounding[index].get_or_init(rows))
    }

    /// Norms of mass-weighted `M^-1 L' K` and `M^-1 L' C`.
    fn norms(&self, scene: &Scene) -> (f64, f64) {
        if let Some(mass) = &scene.coupled_mass {
            let factor = self.equation.amplification(mass);
            let rows = self.bordered.as_ref();
            let [added, merged] =
                rows.map_or([0.0; 2], |rows| rows.added_rates(scene, &self.equation));
            let stiffness = factor * (mass.stiffness_rate + added) + merged;
            return (stiffness, factor * mass.damping_rate);
        }
        let reduction = &self.equation.reduction;
        let norm = |matrix: &SparseMatrix| -> f64 {
            let sum = |row: usize| -> f64 {
                let moves = |k: usize| {
                    reduction.place(k).is_some()
                        || self.weight[k] > 0.0 && self.equation.creeping().contains(&k)
                };
                let entries = matrix.row(row).filter(|entry| moves(entry.0));
                entries.map(|(k, value)| value.abs() / self.weight[k]).sum()
            };
            let of_row = |i: usize| -> f64 {
                reduction.sources(i).map(|(source, factor)| factor.abs() * sum(source)).sum()
            };
            let weighted = |(i, &k): (usize, &usize)| of_row(i) / self.weight[k];
            reduction.kept.iter().enumerate().map(weighted).fold(0.0, f64::max)
        };
        (norm(&scene.stiffness), norm(&scene.damping))
    }

    /// sigma, the bound of the growth of every solution, 1/s.
    pub fn norm(&self) -> f64 {
        self.sigma
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;
    use proptest::prelude::*;

    use super::*;
    use crate::scene::status::Status;
    use crate::scene::{ContactInput, Damping, Direction, Mass, SceneInput, Springs};

    const CONTACTS: usize = 3;
    const SIZE: usize = 40;

    /// What moves the dofs of contacts.
    #[derive(Debug, Clone, Copy)]
    enum Boundary {
        Massive,
        /// Massless, on modes of the structure that holds it.
        Held,
        /// Massless, on modes of the free structure.
        Free,
    }

    /// Modes on three contacts, each with springs of its own or rigid.
    fn reduced(numbers: &[f64], springs: &[[Option<f64>; 2]], boundary: Boundary) -> Scene {
        let random = DMatrix::from_fn(SIZE, SIZE, |i, j| {
            if i < 2 * CONTACTS || i == j { numbers[i * SIZE + j] } else { 0.0 }
        });
        let mut stiffness = &random * random.transpose();
        for i in 2 * CONTACTS..SIZE {
            for j in (2 * CONTACTS..SIZE).filter(|&j| j != i) {
                stiffness[(i, j)] = 0.0;
            }
            stiffness[(i, i)] += 40.0;
        }
        let first = 0..2 * CONTACTS;
        first.clone().for_each(|i| stiffness[(i, i)] += 1.0);
        if matches!(boundary, Boundary::Free) {
            let edge = stiffness.view_range(first.clone(), first.clone()).into_owned();
            let tied = stiffness.view_range(first.clone(), 2 * CONTACTS..).into_owned();
            let followed = edge.cholesky().expect("definite").solve(&tied);
            let pulled = tied.tr_mul(&followed);
            let mut others = stiffness.view_range_mut(2 * CONTACTS.., 2 * CONTACTS..);
            others += 0.5 * (&pulled + pulled.transpose());
        }
        let weight = |k: usize| match boundary {
            Boundary::Massive => 1.5 + numbers[k],
            _ => {
                if first.contains(&k) {
                    0.0
                } else {
                    1.5 + numbers[k]
                }
            }
        };
        let contact = |k: usize| ContactInput {
            tangential: Some(Direction::Dof(2 * k)),
            normal: Some(Direction::Dof(2 * k + 1)),
            friction: 0.5 + 0.1 * k as f64,
            static_friction: 0.9,
            slider_speed: 0.1,
            springs: Springs { tangential: springs[k][0], normal: springs[k][1] },
            ..Default::default()
        };
        let input = SceneInput {
            mass: Mass::Lumped((0..SIZE).map(weight).collect()),
            stiffness: SparseMatrix::from_dense(&stiffness),
            damping: Damping::Proportional { mass: 0.5, stiffness: 1e-3 },
            force: vec![1.0; SIZE],
            contacts: (0..CONTACTS).map(contact).collect(),
            impact_friction: true,
            ..Default::default()
        };
        Scene::new(input).expect("well-posed")
    }

    proptest! {
        /// With compliant contacts and dofs without mass the bounds are not below the norms of what a combination makes of K
        /// and C.
        #[test]
        fn what_follows_is_within_its_bound(
            numbers in proptest::collection::vec(-1.0..1.0f64, SIZE * SIZE),
            springs in proptest::collection::vec((0usize..3, 0.1..1e3f64, 0.1..1e3f64), CONTACTS),
            statuses in proptest::collection::vec(0usize..4, CONTACTS),
            boundary in prop_oneof![
                Just(Boundary::Massive),
                Just(Boundary::Held),
                Just(Boundary::Free),
            ],
        ) {
            let massive = matches!(boundary, Boundary::Massive);
            let springs: Vec<[Option<f64>; 2]> = springs
                .into_iter()
                .enumerate()
                .map(|(k, (kind, a, b))| match kind {
                    0 if k > 0 || !massive => [None, None],
                    1 if massive => [None, Some(b)],
                    _ => [Some(a), Some(b)],
                })
                .collect();
            let scene = reduced(&numbers, &springs, boundary);
            let all = [Status::Positive, Status::Negative, Status::Sticking, Status::Detached];
            let combination = Combination::new(statuses.iter().map(|&s| all[s]).collect());
            let condensed = Condensed::new(&scene, &combination).expect("regular").expect("nodes");
            let left = condensed.scene(&scene);
            let operator =
                TaylorOperator::following(&scene, &combination, &[], &condensed).expect("regular");
            prop_assert!(operator.follows());
            // Of the size of the border, and not of that of the modes.
            let border = 2 * CONTACTS + scene.massless.coordinates.len();
            let own = operator.numbers() - operator.equation.numbers();
            prop_assert!(own <= scene.size + 4 * border * border, "{own} beside {border}");
            let root: Vec<f64> =
                operator.equation.reduction.kept.iter().map(|&k| scene.mass.get(k, k).sqrt()).collect();
            let norm = |matrix: &SparseMatrix| {
                let reduced = operator.equation.reduction.matrix(matrix);
                reduced.map_with_location(|i, j, value| value / (root[i] * root[j])).singular_values().max()
            };
            let (stiffness, damping) = operator.norms(&scene);
            let found = [norm(&left.stiffness), norm(&left.damping)];
            prop_assert!(found[0] <= stiffness * (1.0 + 1e-12), "{} beyond {stiffness}", found[0]);
            prop_assert!(found[1] <= damping * (1.0 + 1e-12), "{} beyond {damping}", found[1]);
        }
    }
}
