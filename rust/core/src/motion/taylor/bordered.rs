//! The equation of motion of a scene whose stiffness couples coordinates through contacts alone, for the vector unit.
//!
//! With `y = q + beta q'` the force on each other coordinate is `-(D y)_i - sum_r K_ri y_r` over the border, and that on
//! the border is `-sum_i K_ri y_i`: one row of K serves both, and an order of the series costs O(n c). A combination
//! needs nothing but the choice of its rows, its merges and the inverse mass of its contact coordinates, and the places of
//! coordinates without mass (see [`Following`]).

use pulp::bytemuck::{cast_slice, cast_slice_mut};

use crate::motion::taylor::doubled_products::{LessDot, LessRow};
use crate::motion::taylor::following::{BLOCK, Following, Places};
use crate::numerics::double_double::Doubled;
use crate::numerics::simd::{GROUP, Group, Kernel, Lanes, VectorUnit, ZEROS, group};
use crate::scene::equation_of_motion::EquationOfMotion;
use crate::scene::inertia::border::{Border, Followers};
use crate::scene::massless::condensation::Condensed;
use crate::scene::model::Scene;

/// One combination of a scene whose stiffness has a border.
#[derive(Debug)]
pub(crate) struct BorderedRows {
    unit: VectorUnit,
    /// Places in the border whose coordinate moves or whose force counts, in whole blocks.
    active: Vec<Option<usize>>,
    /// Kept coordinates of the border.
    kept: Vec<usize>,
    beta: f64,
    /// What the coordinates without mass do.
    following: Option<Following>,
}

/// One order of the series: q'' from its coefficients.
pub(crate) struct Order<'a> {
    /// Coefficients of q of this order and of the next.
    pub q: &'a [f64],
    pub dq: &'a [f64],
    /// From a coefficient of q of the next order to one of q' of this order.
    pub rate: f64,
    /// From a coefficient of q'' of this order to one of q two orders up.
    pub factor: f64,
    /// f of every coordinate, and whether it acts in this order.
    pub force: &'a [f64],
    pub forced: bool,
    pub next: &'a mut [f64],
}

/// Buffers of the products.
#[derive(Debug, Default)]
pub(crate) struct Buffers {
    still: Vec<Group>,
    moved: Vec<Group>,
    sum: Vec<Group>,
    low: Vec<Group>,
    dots: Vec<f64>,
    residual: Vec<f64>,
    acceleration: Vec<f64>,
    places: Places,
}

impl BorderedRows {
    /// None without a border, or where coordinates without mass are part of it and what these do is not known.
    pub fn new(
        scene: &Scene,
        equation: &EquationOfMotion,
        condensed: Option<&Condensed>,
    ) -> Option<Self> {
        let border = border_of(scene)?;
        let following = match (&border.followers, condensed) {
            (None, _) => None,
            (Some(_), None) => return None,
            (Some(followers), Some(condensed)) => {
                Some(Following::new(scene, border, followers, equation, condensed))
            }
        };
        let reduction = &equation.reduction;
        let mut counts = vec![false; scene.size];
        equation.moving().for_each(|k| counts[k] = true);
        reduction.merges.iter().for_each(|merge| counts[merge.normal] = true);
        let places = border.coordinates.iter().enumerate().filter(|(_, k)| counts[**k]);
        let mut active: Vec<Option<usize>> = places.map(|(place, _)| Some(place)).collect();
        active.resize(active.len().next_multiple_of(BLOCK), None);
        let contacts = &border.coordinates[..border.contacts];
        let kept = contacts.iter().copied().filter(|&k| reduction.place(k).is_some()).collect();
        Some(Self { unit: VectorUnit::default(), active, kept, beta: border.beta, following })
    }

    /// Whether it finds the places of coordinates without mass.
    pub fn follows(&self) -> bool {
        self.following.is_some()
    }

    /// About how many numbers it holds.
    pub fn numbers(&self) -> usize {
        self.active.len() + self.following.as_ref().map_or(0, Following::numbers)
    }

    /// What the coordinates without mass add to the stiffness; see [`Following::rates`]. 1/s^2
    pub fn added_rates(&self, scene: &Scene, equation: &EquationOfMotion) -> [f64; 2] {
        let followers = border_of(scene).and_then(|border| border.followers.as_ref());
        let following = self.following.as_ref().zip(followers);
        following.map_or([0.0; 2], |(own, followers)| own.rates(scene, followers, equation))
    }

    /// Fills one order of the series.
    pub fn advance(
        &self,
        scene: &Scene,
        equation: &EquationOfMotion,
        order: Order<'_>,
        buffers: &mut Buffers,
    ) {
        let border = border_of(scene).expect(BORDERED);
        let Order { q, dq, rate, factor, force, forced, next } = order;
        let Buffers { still, moved, sum, dots, residual, acceleration, places, .. } = buffers;
        moved.resize(border.groups, ZEROS);
        sum.resize(border.groups, ZEROS);
        dots.resize(self.active.len(), 0.0);
        residual.resize(q.len(), 0.0);
        acceleration.resize(q.len(), 0.0);
        let beta = self.beta * rate;
        let load = |k: usize| if forced { force[k] } else { 0.0 };
        let rows = &self.active;
        let loads = if forced { force } else { &[] };
        let (sum, to) = (&mut *sum, &mut *next);
        let following = self.following.as_ref().zip(border.followers.as_ref());
        if following.is_some() {
            still.resize(border.groups, ZEROS);
            cast_slice_mut(still)[..q.len()].copy_from_slice(q);
        }
        self.unit.run(Product {
            border,
            rows,
            following,
            still: &*still,
            places: &mut *places,
            pulled: &mut *residual,
            moved,
            sum,
            dots: &mut *dots,
            loads,
            beta,
            q,
            dq,
            rate,
            factor,
            next: to,
        });
        // The border follows; what is held stays at zero, even where the rest is beyond the range of numbers.
        border.coordinates.iter().chain(&border.massless).for_each(|&k| next[k] = 0.0);
        for (place, dot) in self.active.iter().zip(dots) {
            let Some(place) = place else { continue };
            let k = border.coordinates[*place];
            residual[k] = load(k) - (residual[k] + *dot);
            for &(j, drag) in border.drags.get(*place).into_iter().flatten() {
                residual[k] -= rate * drag * dq[j];
            }
        }
        if let Some(following) = &self.following {
            following.react(q, places, residual);
        }
        equation.accelerate_contacts(&self.kept, residual, acceleration);
        self.kept.iter().for_each(|&k| next[k] = factor * acceleration[k]);
        // An oscillator counts from the place at which the phase began.
        for &(k, square) in &border.loads {
            let from = if forced { force[k] / scene.mass.get(k, k) } else { 0.0 };
            next[k] = factor * (from - square * q[k]);
        }
    }

    /// `L' (F - K q)`, summed in doubled precision.
    pub fn balance(
        &self,
        scene: &Scene,
        equation: &EquationOfMotion,
        q: &[f64],
        force: &mut [f64],
        buffers: &mut Buffers,
    ) {
        let border = border_of(scene).expect(BORDERED);
        let Buffers { moved, sum, low, places, .. } = buffers;
        let given = self.following.as_ref().map_or(&scene.force, |following| &following.force);
        for (buffer, values) in [(&mut *moved, q), (&mut *sum, &given[..])] {
            buffer.clear();
            buffer.resize(border.groups, ZEROS);
            cast_slice_mut(buffer)[..q.len()].copy_from_slice(values);
        }
        low.clear();
        low.resize(border.groups, ZEROS);
        // A given normal force is that of a coordinate without mass or stiffness, which is not on the border.
        let mut rows: Vec<Doubled> = scene.force.iter().map(|&force| force.into()).collect();
        if let (Some(following), Some(followers)) = (&self.following, &border.followers) {
            let sums = [&mut sum[..], &mut low[..]];
            following.balance(self.unit, followers, moved, sums, &mut rows, places);
            let (high, low): (&[f64], &[f64]) = (cast_slice(sum), cast_slice(low));
            for &k in &border.coordinates {
                rows[k] = Doubled { high: high[k], low: low[k] };
            }
        }
        for &place in self.active.iter().flatten() {
            let (k, row) = (border.coordinates[place], border.row(Some(place)));
            let dot = LessDot { sum: rows[k], row: cast_slice(row), moved: cast_slice(moved) };
            rows[k] = self.unit.run(dot);
            self.unit.run(LessRow { row, by: [q[k], 0.0], sum: &mut *sum, low: &mut *low });
        }
        let inverse: &[f64] = cast_slice(&border.inverse_mass);
        let diagonal: &[f64] = cast_slice(&border.diagonal);
        let (high, low): (&[f64], &[f64]) = (cast_slice(sum), cast_slice(low));
        for (i, force) in force.iter_mut().enumerate().filter(|(i, _)| inverse[*i] != 0.0) {
            let others = Doubled { high: high[i], low: low[i] };
            *force = others.add(Doubled::product(-diagonal[i], q[i])).value();
        }
        let kept = &equation.reduction.kept;
        for merge in &equation.reduction.merges {
            let merged = rows[merge.normal].times(merge.factor);
            rows[kept[merge.position]] = rows[kept[merge.position]].add(merged);
        }
        self.kept.iter().for_each(|&k| force[k] = rows[k].value());
        border.loads.iter().for_each(|&(k, _)| force[k] = -scene.stiffness.get(k, k) * q[k]);
    }
}

/// Why a scene has one.
const BORDERED: &str = "rows with a border are of a scene with one";

/// The border of the stiffness of a scene.
pub(crate) fn border_of(scene: &Scene) -> Option<&Border> {
    scene.coupled_mass.as_deref()?.border.as_ref()
}

/// Whether series of a scene find by themselves what follows, beside its border. Laws of friction bound theirs by other norms.
pub(crate) fn has_followers(scene: &Scene) -> bool {
    !scene.is_nonlinear() && border_of(scene).is_some_and(|border| border.followers.is_some())
}

/// y, `D y` and the active rows: their products with y, and what their coordinates add to the others.
struct Product<'a> {
    border: &'a Border,
    rows: &'a [Option<usize>],
    following: Option<(&'a Following, &'a Followers)>,
    /// q
    still: &'a [Group],
    places: &'a mut Places,
    /// The forces on the border from what follows.
    pulled: &'a mut [f64],
    moved: &'a mut [Group],
    sum: &'a mut [Group],
    dots: &'a mut [f64],
    /// Loads of the coordinates, if they act in this order.
    loads: &'a [f64],
    /// From dq to what damping adds to q.
    beta: f64,
    q: &'a [f64],
    dq: &'a [f64],
    rate: f64,
    factor: f64,
    next: &'a mut [f64],
}

impl Kernel for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { border, rows, following, still, places, pulled, moved, sum, dots, .. } = self;
        let Self { loads, beta, q, dq, rate, factor, next, .. } = self;
        let groups = border.groups;
        let y: &mut [f64] = &mut cast_slice_mut(moved)[..q.len()];
        let dq = &dq[..q.len()];
        for j in 0..q.len() {
            y[j] = q[j] + beta * dq[j];
        }
        // Loads are forces by their place.
        border.loads.iter().for_each(|&(k, _)| y[k] = q[k]);
        let (moved, sum, diagonal) =
            (&moved[..groups], &mut sum[..groups], &border.diagonal[..groups]);
        for g in 0..groups {
            sum[g] = simd.mul_f64s(diagonal[g], moved[g]);
        }
        match following {
            None => border.coordinates.iter().for_each(|&k| pulled[k] = 0.0),
            Some((following, followers)) => {
                following.add(simd, followers, [still, moved], sum, places);
                let sum: &[f64] = cast_slice(sum);
                border.coordinates.iter().for_each(|&k| pulled[k] = sum[k]);
            }
        }
        let y: &[f64] = cast_slice(moved);
        for (places, dots) in rows.chunks_exact(BLOCK).zip(dots.chunks_exact_mut(BLOCK)) {
            let mut of = [&border.rows[..0]; BLOCK];
            let mut x = [ZEROS; BLOCK];
            for r in 0..BLOCK {
                of[r] = &border.row(places[r])[..groups];
                if let Some(place) = places[r] {
                    x[r] = group([y[border.coordinates[place]]; GROUP]);
                }
            }
            let mut products = [ZEROS; BLOCK];
            for g in 0..groups {
                let mut total = sum[g];
                for r in 0..BLOCK {
                    products[r] = simd.mul_add_f64s(of[r][g], moved[g], products[r]);
                    total = simd.mul_add_f64s(of[r][g], x[r], total);
                }
                sum[g] = total;
            }
            for r in 0..BLOCK {
                dots[r] = simd.reduce_sum_f64s(products[r]);
            }
        }
        let (sum, inverse): (&[f64], &[f64]) = (cast_slice(sum), cast_slice(&border.inverse_mass));
        let n = next.len();
        let decay: &[f64] = cast_slice(&border.decay);
        let (sum, inverse, dq, decay) = (&sum[..n], &inverse[..n], &dq[..n], &decay[..n]);
        for i in 0..n {
            next[i] = -factor * (inverse[i] * sum[i] + rate * decay[i] * dq[i]);
        }
        for (i, load) in loads.iter().enumerate() {
            next[i] += factor * (inverse[i] * load);
        }
    }
}
