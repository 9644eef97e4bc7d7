//! Groups of four numbers and the vector unit of the machine that works on them, found at run time.

use num_complex::Complex64;
use pulp::{NullaryFnOnce, Scalar256b, Simd, bytemuck, cast};

/// What one vector instruction works on.
pub(crate) use pulp::f64x4 as Group;

/// Numbers are kept in groups of this many, the last filled up with zeros: no loop has a remainder.
pub(crate) const GROUP: usize = 4;

pub(crate) const ZEROS: Group = pulp::f64x4(0.0, 0.0, 0.0, 0.0);

/// Arithmetic on groups; products and sums are fused on every machine.
pub(crate) trait Lanes: Simd<f64s = Group> {}

impl<S: Simd<f64s = Group>> Lanes for S {}

/// Work compiled for each vector unit. Only what is inlined into `run` is.
pub(crate) trait Kernel {
    type Output;

    fn run<S: Lanes>(self, simd: S) -> Self::Output;
}

/// Elsewhere than on x86-64 the compiler finds the vector instructions for loops over four lanes.
#[derive(Debug, Clone, Copy)]
pub(crate) enum VectorUnit {
    #[cfg(target_arch = "x86_64")]
    Avx2(pulp::x86::V3),
    Portable,
}

impl Default for VectorUnit {
    fn default() -> Self {
        #[cfg(target_arch = "x86_64")]
        if let Some(simd) = pulp::x86::V3::try_new() {
            return Self::Avx2(simd);
        }
        Self::Portable
    }
}

impl VectorUnit {
    #[inline(always)]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(simd) => simd.vectorize(Call { kernel, simd }),
            Self::Portable => portable(kernel),
        }
    }
}

/// Apart from its callers, which do without it on every machine with the vector unit.
#[cfg_attr(target_arch = "x86_64", cold)]
#[inline(never)]
fn portable<K: Kernel>(kernel: K) -> K::Output {
    kernel.run(Scalar256b)
}

struct Call<K, S> {
    kernel: K,
    simd: S,
}

impl<K: Kernel, S: Lanes> NullaryFnOnce for Call<K, S> {
    type Output = K::Output;

    #[inline(always)]
    fn call(self) -> K::Output {
        self.kernel.run(self.simd)
    }
}

/// Groups that are worked on side by side, as many as a sum has to wait for itself.
const SIDE: usize = 4;

/// Columns side by side.
pub(crate) const COLUMNS: usize = SIDE * GROUP;

/// One number of each of several columns.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Side([Group; SIDE]);

impl Side {
    pub const ZERO: Self = Self([ZEROS; SIDE]);

    pub fn columns(&self) -> &[f64; COLUMNS] {
        bytemuck::cast_ref(&self.0)
    }

    pub fn columns_mut(&mut self) -> &mut [f64; COLUMNS] {
        bytemuck::cast_mut(&mut self.0)
    }

    /// `self + t a`
    #[inline(always)]
    pub fn add_scaled<S: Lanes>(mut self, simd: S, t: f64, a: &Self) -> Self {
        let t = simd.splat_f64s(t);
        for (sum, a) in self.0.iter_mut().zip(&a.0) {
            *sum = simd.mul_add_f64s(t, *a, *sum);
        }
        self
    }

    /// `t self`
    #[inline(always)]
    pub fn scaled<S: Lanes>(&self, simd: S, t: f64) -> Self {
        Self::ZERO.add_scaled(simd, t, self)
    }

    /// `a x + b y`
    #[inline(always)]
    pub fn combined<S: Lanes>(simd: S, [a, b]: [f64; 2], [x, y]: [&Self; 2]) -> Self {
        x.scaled(simd, a).add_scaled(simd, b, y)
    }
}

/// Four complex numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ComplexGroup {
    pub re: Group,
    pub im: Group,
}

impl ComplexGroup {
    pub const ZERO: Self = Self { re: ZEROS, im: ZEROS };

    pub fn of(lanes: [Complex64; GROUP]) -> Self {
        Self { re: group(lanes.map(|value| value.re)), im: group(lanes.map(|value| value.im)) }
    }

    #[inline(always)]
    pub fn get(&self, lane: usize) -> Complex64 {
        let [re, im]: [[f64; GROUP]; 2] = [cast(self.re), cast(self.im)];
        Complex64::new(re[lane], im[lane])
    }

    #[inline(always)]
    pub fn set(&mut self, lane: usize, value: Complex64) {
        bytemuck::cast_mut::<Group, [f64; GROUP]>(&mut self.re)[lane] = value.re;
        bytemuck::cast_mut::<Group, [f64; GROUP]>(&mut self.im)[lane] = value.im;
    }

    /// `self + a b`
    #[inline(always)]
    pub fn add_product<S: Lanes>(self, simd: S, a: Self, b: Self) -> Self {
        Self {
            re: add_real_part(simd, self.re, a, b),
            im: simd.mul_add_f64s(a.im, b.re, simd.mul_add_f64s(a.re, b.im, self.im)),
        }
    }

    /// `self + t a` with real t.
    #[inline(always)]
    pub fn add_scaled<S: Lanes>(self, simd: S, t: Group, a: Self) -> Self {
        Self { re: simd.mul_add_f64s(t, a.re, self.re), im: simd.mul_add_f64s(t, a.im, self.im) }
    }

    /// Upper bounds of the moduli, within a factor of sqrt 2.
    #[inline(always)]
    pub fn size<S: Lanes>(self, simd: S) -> Group {
        simd.add_f64s(simd.abs_f64s(self.re), simd.abs_f64s(self.im))
    }
}

/// `sum + Re(a b)`
#[inline(always)]
pub(crate) fn add_real_part<S: Lanes>(
    simd: S,
    sum: Group,
    a: ComplexGroup,
    b: ComplexGroup,
) -> Group {
    simd.negate_mul_add_f64s(a.im, b.im, simd.mul_add_f64s(a.re, b.re, sum))
}

#[inline(always)]
pub(crate) fn group(numbers: [f64; GROUP]) -> Group {
    cast(numbers)
}

/// The first numbers; lanes beyond hold what follows, or zeros.
#[inline(always)]
pub(crate) fn lanes_of<S: Lanes>(simd: S, numbers: &[f64], lanes: usize) -> Group {
    match numbers.first_chunk::<GROUP>() {
        Some(whole) => cast(*whole),
        None => simd.partial_load_f64s(&numbers[..lanes]),
    }
}

/// The lanes of a group that there is room for.
#[inline(always)]
pub(crate) fn store(group: Group, into: &mut [f64]) {
    match into.first_chunk_mut::<GROUP>() {
        Some(whole) => *whole = cast(group),
        None => {
            let lanes: [f64; GROUP] = cast(group);
            into.copy_from_slice(&lanes[..into.len()]);
        }
    }
}

/// Numbers in groups, the last filled up with zeros.
pub(crate) fn in_groups(numbers: &[f64]) -> Vec<Group> {
    let whole = numbers.chunks(GROUP).map(|chunk| {
        let mut lanes = [0.0; GROUP];
        lanes[..chunk.len()].copy_from_slice(chunk);
        group(lanes)
    });
    whole.collect()
}

/// Complex numbers in groups.
#[derive(Debug, Clone, Default)]
pub(crate) struct ComplexVector(pub Vec<ComplexGroup>);

impl ComplexVector {
    pub fn of(values: &[Complex64]) -> Self {
        Self(complex_groups(values).collect())
    }

    #[inline(always)]
    pub fn get(&self, r: usize) -> Complex64 {
        self.0[r / GROUP].get(r % GROUP)
    }
}

/// Complex numbers in groups, the last filled up with zeros.
pub(crate) fn complex_groups(values: &[Complex64]) -> impl Iterator<Item = ComplexGroup> {
    values.chunks(GROUP).map(|chunk| {
        let mut lanes = [Complex64::default(); GROUP];
        lanes[..chunk.len()].copy_from_slice(chunk);
        ComplexGroup::of(lanes)
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// `sum + a b`, `sum + t a` and `|re| + |im|` of four complex numbers each.
    struct Products([[Complex64; GROUP]; 3], f64);

    impl Kernel for Products {
        type Output = [[[f64; GROUP]; 2]; 3];

        #[inline(always)]
        fn run<S: Lanes>(self, simd: S) -> Self::Output {
            let [sum, a, b] = self.0.map(ComplexGroup::of);
            let product = sum.add_product(simd, a, b);
            let scaled = sum.add_scaled(simd, simd.splat_f64s(self.1), a);
            let real = add_real_part(simd, sum.re, a, b);
            [
                [cast(product.re), cast(product.im)],
                [cast(scaled.re), cast(scaled.im)],
                [cast(real), cast(a.size(simd))],
            ]
        }
    }

    fn complex() -> impl Strategy<Value = [Complex64; GROUP]> {
        proptest::array::uniform4(
            (-2.0..2.0, -2.0..2.0).prop_map(|(re, im)| Complex64::new(re, im)),
        )
    }

    proptest! {
        /// Every vector unit gives the bits of fused scalar arithmetic.
        #[test]
        fn lanes_are_fused_scalars(sum in complex(), a in complex(), b in complex(), t in -2.0..2.0f64) {
            let found = VectorUnit::default().run(Products([sum, a, b], t));
            prop_assert_eq!(found, VectorUnit::Portable.run(Products([sum, a, b], t)));
            for lane in 0..GROUP {
                let (z, a, b) = (sum[lane], a[lane], b[lane]);
                let re = (-a.im).mul_add(b.im, a.re.mul_add(b.re, z.re));
                let im = a.im.mul_add(b.re, a.re.mul_add(b.im, z.im));
                let expected = [
                    [re, im],
                    [t.mul_add(a.re, z.re), t.mul_add(a.im, z.im)],
                    [re, a.re.abs() + a.im.abs()],
                ];
                prop_assert_eq!(found.map(|parts| parts.map(|group| group[lane])), expected);
            }
        }
    }

    #[test]
    fn lanes_are_read_and_written() {
        let mut group = ComplexGroup::of([1.0, 2.0, 3.0, 4.0].map(|x| Complex64::new(x, -x)));
        group.set(2, Complex64::new(7.0, 8.0));
        assert_eq!(group.get(2), Complex64::new(7.0, 8.0));
        assert_eq!(group.get(3), Complex64::new(4.0, -4.0));
        let groups: Vec<[f64; GROUP]> =
            in_groups(&[1.0, 2.0, 3.0, 4.0, 5.0]).into_iter().map(cast).collect();
        assert_eq!(groups, [[1.0, 2.0, 3.0, 4.0], [5.0, 0.0, 0.0, 0.0]]);
    }
}
