//! Sparse rows of a region, four at a time, and what a series needs of them.

use pulp::cast;

use crate::motion::taylor::doubled_products::less_product;
use crate::numerics::double_double::Doubled;
use crate::numerics::first_root::polynomial::DEGREE;
use crate::numerics::simd::{GROUP, Group, Kernel, Lanes, ZEROS, group};

/// One entry of each row of a group.
#[derive(Debug, Clone, Copy)]
struct Entries {
    columns: [u32; GROUP],
    values: [f64; GROUP],
}

/// Rows in groups, each filled up with zeros to the longest of its group.
#[derive(Debug, Default)]
pub(super) struct Rows {
    count: usize,
    /// Where the entries of each group end.
    ends: Vec<usize>,
    entries: Vec<Entries>,
}

impl Rows {
    pub fn clear(&mut self) {
        self.count = 0;
        self.ends.clear();
        self.entries.clear();
    }

    /// Adds a row of (column, value).
    pub fn push(&mut self, row: impl Iterator<Item = (u32, f64)>) {
        let lane = self.count % GROUP;
        self.count += 1;
        let first = if lane == 0 {
            self.ends.push(self.entries.len());
            self.entries.len()
        } else {
            self.ends.iter().rev().nth(1).copied().unwrap_or(0)
        };
        for (place, (column, value)) in row.enumerate() {
            if first + place == self.entries.len() {
                self.entries.push(Entries { columns: [0; GROUP], values: [0.0; GROUP] });
            }
            let entries = &mut self.entries[first + place];
            (entries.columns[lane], entries.values[lane]) = (column, value);
        }
        if let Some(end) = self.ends.last_mut() {
            *end = self.entries.len();
        }
    }

    /// Entries of the longest row.
    pub fn longest(&self) -> usize {
        self.groups().map(<[Entries]>::len).max().unwrap_or(0)
    }

    /// The entries of one group after the other.
    #[inline(always)]
    fn groups(&self) -> impl Iterator<Item = &[Entries]> {
        let mut first = 0;
        self.ends.iter().map(move |&end| &self.entries[std::mem::replace(&mut first, end)..end])
    }
}

impl Entries {
    #[inline(always)]
    fn gather(&self, x: &[f64]) -> Group {
        let [a, b, c, d] = self.columns;
        group([x[a as usize], x[b as usize], x[c as usize], x[d as usize]])
    }
}

/// A row that adds a multiple of another to itself.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rubbed {
    pub row: usize,
    pub normal: usize,
    pub factor: f64,
}

/// `sums -= rows x`, in doubled precision.
pub(super) struct Balance<'a> {
    pub rows: &'a Rows,
    pub x: &'a [f64],
    pub sums: &'a mut [Doubled],
}

impl Kernel for Balance<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { rows, x, sums } = self;
        for (sums, entries) in sums.chunks_mut(GROUP).zip(rows.groups()) {
            let mut dot = [ZEROS; 2];
            for entry in entries {
                dot = less_product(simd, dot, group(entry.values), entry.gather(x));
            }
            let [high, low]: [[f64; GROUP]; 2] = dot.map(cast);
            for (lane, sum) in sums.iter_mut().enumerate() {
                *sum = sum.add(Doubled { high: high[lane], low: low[lane] });
            }
        }
    }
}

/// All orders of a series from the first two.
pub(super) struct Fill<'a> {
    /// Of `[q + beta q', q']` of all members.
    pub rows: &'a Rows,
    pub rubbed: &'a [Rubbed],
    /// 0 of what does not move freely; of those within.
    pub inverse_mass: &'a [f64],
    /// At the origin.
    pub force: &'a [f64],
    pub beta: f64,
    pub width: f64,
    /// Members.
    pub count: usize,
    pub terms: &'a mut [f64],
    /// Room for `[q + beta q', q']`, and for the groups of rows.
    pub moved: &'a mut [f64],
    pub products: &'a mut [f64],
}

impl Kernel for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { rows, rubbed, inverse_mass, force, beta, width, count, .. } = self;
        let Self { terms, moved, products, .. } = self;
        for k in 0..DEGREE {
            let (known, next) = terms.split_at_mut((k + 2) * count);
            let (q, dq) = known[k * count..].split_at(count);
            let rate = (k + 1) as f64 / width;
            let factor = width * width / ((k + 1) * (k + 2)) as f64;
            let (places, speeds) = moved.split_at_mut(count);
            for ((place, speed), (q, dq)) in places.iter_mut().zip(speeds).zip(q.iter().zip(dq)) {
                *speed = rate * dq;
                *place = q + beta * *speed;
            }
            for (products, entries) in
                products.as_chunks_mut::<GROUP>().0.iter_mut().zip(rows.groups())
            {
                let mut dot = ZEROS;
                for entry in entries {
                    dot = simd.mul_add_f64s(group(entry.values), entry.gather(moved), dot);
                }
                *products = cast(dot);
            }
            for &Rubbed { row, normal, factor } in rubbed {
                products[row] += factor * products[normal];
            }
            let forced = if k == 0 { 1.0 } else { 0.0 };
            let own = inverse_mass.iter().zip(force.iter().zip(products.iter()));
            for (next, (inverse, (force, product))) in next.iter_mut().zip(own) {
                *next = factor * inverse * (forced * force - product);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::numerics::simd::VectorUnit;

    proptest! {
        /// Rows of any number and length are subtracted in doubled precision, on every vector unit.
        #[test]
        fn rows_in_groups_are_rows(
            rows in proptest::collection::vec(
                proptest::collection::vec((0u32..7, -1.0..1.0f64), 0..9),
                0..11,
            ),
            x in proptest::collection::vec(-1.0..1.0f64, 7),
        ) {
            let mut grouped = Rows::default();
            rows.iter().for_each(|row| grouped.push(row.iter().copied()));
            let by = |unit: VectorUnit| {
                let mut sums = vec![Doubled::from(0.25); rows.len()];
                unit.run(Balance { rows: &grouped, x: &x, sums: &mut sums });
                sums
            };
            let found = by(VectorUnit::default());
            prop_assert_eq!(&found, &by(VectorUnit::Portable));
            for (row, found) in rows.iter().zip(found) {
                let terms = row.iter().map(|&(k, value)| Doubled::product(-value, x[k as usize]));
                let expected = terms.fold(Doubled::from(0.25), Doubled::add);
                let error = (found.high - expected.high) + (found.low - expected.low);
                prop_assert!(error.abs() <= 1e-30, "{found:?} of {expected:?}");
            }
        }
    }
}
