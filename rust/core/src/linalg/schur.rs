//! Real Schur form of small matrices: Householder Hessenberg form, then Francis double-shift QR.
//!
//! The algorithm is EISPACK's `orthes`, `hqr2` and `hqr` (Smith et al. 1976; Golub and Van Loan 2013,
//! section 7.5), on matrices as row-major slices of `n * n`.
//!
//! Two reasons keep this algorithm beside those of the libraries. faer's set-up takes longer than all work on a matrix of a
//! dozen rows, and sweeps and studies solve millions of such matrices. nalgebra's algorithm takes about 1.5 times as long (4
//! rows: 1.41 against 0.90 us, 6 rows: 3.29 against 2.25 us), and it has no exceptional shifts: of 1000 companion matrices
//! with integers up to 2 it never converges on 23 of four rows, 11 of six and 7 of eight, where this one always converges.
//! `cargo bench --bench small_schur` measures both.

use std::ops::Range;

use num_complex::Complex64;

/// Matrices up to this size are solved here, larger ones by the library, whose blocked algorithms win from there on
/// (measured on 8 to 64 rows).
pub(crate) const SMALL: usize = 32;
/// QR sweeps per eigenvalue after which the iteration counts as failed; three is usual. Blocks with two complex pairs of
/// nearly equal modulus can wander: of 20 000 matrices in the neighbourhood of such a one a quarter took more than 60 sweeps,
/// 2.6 % more than 120, 0.1 % more than 200 and none more than 300.
const SWEEPS: usize = 500;
/// Sweeps after which two real shifts become twice the one closer to the corner, as in LAPACK: there are
/// four-rowed blocks with two complex pairs on which the plain pair of shifts wanders without end. Other
/// matrices are deflated before.
const LATE: usize = 10;
/// Range in which a sum of squares is right to rounding; beyond, its terms overflow, or lose digits.
const LEAST_SQUARE: f64 = 1e-280;
const LARGEST_SQUARE: f64 = 1e280;
/// A vector grown beyond this is scaled back, so that a chain of coalesced eigenvalues can't overflow.
const GROWN: f64 = 1e100;

/// Calls a function whose first argument is the number of rows, as a constant for the sizes that mechanisms of a few
/// masses have: the compiler then drops most of the bookkeeping around their short loops.
macro_rules! with_known_size {
    ($function:ident($size:expr $(, $argument:expr)*)) => {
        match $size {
            4 => $function(4 $(, $argument)*),
            5 => $function(5 $(, $argument)*),
            6 => $function(6 $(, $argument)*),
            7 => $function(7 $(, $argument)*),
            8 => $function(8 $(, $argument)*),
            n => $function(n $(, $argument)*),
        }
    };
}

/// Overwrites `h` with its upper Hessenberg form `Q' h Q`; Q' is stored to `q` if given.
pub(crate) fn hessenberg(n: usize, h: &mut [f64], q: Option<&mut [f64]>) {
    with_known_size!(reduced_to_hessenberg(n, h, q));
}

#[inline(always)]
fn reduced_to_hessenberg(n: usize, h: &mut [f64], mut q: Option<&mut [f64]>) {
    let h = &mut h[..n * n];
    if let Some(q) = q.as_deref_mut() {
        q.fill(0.0);
        (0..n).for_each(|i| q[i * n + i] = 1.0);
    }
    let (mut vector, mut factors) = ([0.0; SMALL], [0.0; SMALL]);
    let (vector, factors) = (&mut vector[..n], &mut factors[..n]);
    for m in 1..n.saturating_sub(1) {
        let scale: f64 = (m..n).map(|i| h[i * n + m - 1].abs()).sum();
        if scale == 0.0 {
            continue;
        }
        let mut square = 0.0;
        for i in m..n {
            vector[i] = h[i * n + m - 1] / scale;
            square += vector[i] * vector[i];
        }
        let length = if vector[m] > 0.0 { -square.sqrt() } else { square.sqrt() };
        let inverse = 1.0 / (square - vector[m] * length);
        vector[m] -= length;
        // Row by row, as the matrix is stored: first all factors of the columns, then the rows.
        factors.fill(0.0);
        for i in m..n {
            let entry = vector[i] * inverse;
            let row = &h[i * n + m..(i + 1) * n];
            factors[m..].iter_mut().zip(row).for_each(|(factor, a)| *factor += entry * a);
        }
        for i in m..n {
            let entry = vector[i];
            let row = &mut h[i * n + m..(i + 1) * n];
            row.iter_mut().zip(&factors[m..]).for_each(|(a, factor)| *a -= entry * factor);
        }
        for row in h.chunks_exact_mut(n) {
            let (row, vector) = (&mut row[m..], &vector[m..]);
            let dot: f64 = row.iter().zip(vector).map(|(a, v)| a * v).sum();
            let factor = dot * inverse;
            row.iter_mut().zip(vector).for_each(|(a, v)| *a -= factor * v);
        }
        if let Some(q) = q.as_deref_mut() {
            factors.fill(0.0);
            let rows = q.chunks_exact(n).zip(&*vector).skip(m);
            rows.for_each(|(row, v)| factors.iter_mut().zip(row).for_each(|(f, a)| *f += a * v));
            factors.iter_mut().for_each(|factor| *factor *= inverse);
            let rows = q.chunks_exact_mut(n).zip(&*vector).skip(m);
            rows.for_each(|(row, v)| row.iter_mut().zip(&*factors).for_each(|(a, f)| *a -= f * v));
        }
        h[m * n + m - 1] = scale * length;
        (m + 1..n).for_each(|i| h[i * n + m - 1] = 0.0);
    }
}

/// Eigenvalues of the upper Hessenberg matrix `h`, conjugates adjacent, +Im first; false if the
/// iteration failed. With `q`, `h` becomes quasi-triangular and `q`, transposed, accumulates the rotations.
pub(crate) fn francis(
    n: usize,
    h: &mut [f64],
    q: Option<&mut [f64]>,
    values: &mut [Complex64],
) -> bool {
    with_known_size!(iterated(n, h, q, values))
}

#[inline(always)]
fn iterated(n: usize, h: &mut [f64], mut q: Option<&mut [f64]>, values: &mut [Complex64]) -> bool {
    let h = &mut h[..n * n];
    let norm: f64 = (0..n)
        .map(|i| h[i * n + i.saturating_sub(1)..(i + 1) * n].iter().map(|x| x.abs()).sum::<f64>())
        .sum();
    if !norm.is_finite() {
        return false;
    }
    let mut shifted = 0.0;
    let mut sweeps = 0;
    // Rows 0..end are still to be deflated.
    let mut end = n;
    while end > 0 {
        let last = end - 1;
        let mut first = last;
        while first > 0 {
            let neighbours = h[(first - 1) * n + first - 1].abs() + h[first * n + first].abs();
            let neighbours = if neighbours == 0.0 { norm } else { neighbours };
            if h[first * n + first - 1].abs() < f64::EPSILON * neighbours {
                break;
            }
            first -= 1;
        }
        if first == last {
            h[last * n + last] += shifted;
            values[last] = h[last * n + last].into();
            if last > 0 {
                h[last * n + last - 1] = 0.0;
            }
            end -= 1;
            sweeps = 0;
        } else if first + 1 == last {
            split_pair(n, h, q.as_deref_mut(), values, last, shifted);
            end -= 2;
            sweeps = 0;
        } else if sweeps == SWEEPS {
            return false;
        } else {
            sweep(n, h, q.as_deref_mut(), first, last, sweeps, &mut shifted);
            sweeps += 1;
        }
    }
    true
}

/// Eigenvalues of the deflated 2 by 2 block that ends at `last`; a real pair is made triangular.
#[inline(always)]
fn split_pair(
    n: usize,
    h: &mut [f64],
    q: Option<&mut [f64]>,
    values: &mut [Complex64],
    last: usize,
    shifted: f64,
) {
    let upper = last - 1;
    let product = h[last * n + upper] * h[upper * n + last];
    let half = 0.5 * (h[upper * n + upper] - h[last * n + last]);
    let discriminant = half * half + product;
    h[last * n + last] += shifted;
    h[upper * n + upper] += shifted;
    if upper > 0 {
        h[upper * n + upper - 1] = 0.0;
    }
    let corner = h[last * n + last];
    if discriminant < 0.0 {
        let value = Complex64::new(corner + half, (-discriminant).sqrt());
        values[upper] = value;
        values[last] = value.conj();
        return;
    }
    let root = if half >= 0.0 { half + discriminant.sqrt() } else { half - discriminant.sqrt() };
    values[upper] = (corner + root).into();
    values[last] = if root != 0.0 { (corner - product / root).into() } else { values[upper] };
    let Some(q) = q else { return };
    let below = h[last * n + upper];
    let length = below.hypot(root);
    if length == 0.0 {
        return;
    }
    let (sine, cosine) = (below / length, root / length);
    for j in upper..n {
        let (x, y) = (h[upper * n + j], h[last * n + j]);
        h[upper * n + j] = cosine * x + sine * y;
        h[last * n + j] = cosine * y - sine * x;
    }
    for row in h.chunks_exact_mut(n).take(last + 1) {
        let (x, y) = (row[upper], row[last]);
        row[upper] = cosine * x + sine * y;
        row[last] = cosine * y - sine * x;
    }
    for j in 0..n {
        let (x, y) = (q[upper * n + j], q[last * n + j]);
        q[upper * n + j] = cosine * x + sine * y;
        q[last * n + j] = cosine * y - sine * x;
    }
    h[last * n + upper] = 0.0;
    h[upper * n + upper] = values[upper].re;
    h[last * n + last] = values[last].re;
}

/// One implicit double-shift sweep over the active rows `first..=last`.
#[inline(always)]
fn sweep(
    n: usize,
    h: &mut [f64],
    mut q: Option<&mut [f64]>,
    first: usize,
    last: usize,
    sweeps: usize,
    shifted: &mut f64,
) {
    let at = |i: usize, j: usize| i * n + j;
    let mut x = h[at(last, last)];
    let mut y = h[at(last - 1, last - 1)];
    let mut w = h[at(last, last - 1)] * h[at(last - 1, last)];
    // Exceptional shifts of EISPACK break the rare cycles.
    if sweeps % 10 == 9 {
        *shifted += x;
        (0..=last).for_each(|i| h[at(i, i)] -= x);
        let size = h[at(last, last - 1)].abs() + h[at(last - 1, last - 2)].abs();
        x = 0.75 * size;
        y = x;
        w = -0.4375 * size * size;
    } else if sweeps >= LATE {
        let half = 0.5 * (y - x);
        let discriminant = half * half + w;
        if discriminant >= 0.0 {
            let root = half + discriminant.sqrt().copysign(half);
            let closer = if root == 0.0 { x } else { x - w / root };
            (x, y, w) = (closer, closer, 0.0);
        }
    }
    let mut start = last - 2;
    let (mut p, mut r, mut s);
    loop {
        let z = h[at(start, start)];
        let (dx, dy) = (x - z, y - z);
        p = (dx * dy - w) / h[at(start + 1, start)] + h[at(start, start + 1)];
        r = h[at(start + 1, start + 1)] - z - dx - dy;
        s = h[at(start + 2, start + 1)];
        if start == first {
            break;
        }
        let coupling = h[at(start, start - 1)].abs() * (r.abs() + s.abs());
        let diagonal =
            h[at(start - 1, start - 1)].abs() + z.abs() + h[at(start + 1, start + 1)].abs();
        if coupling < f64::EPSILON * p.abs() * diagonal {
            break;
        }
        start -= 1;
    }
    for i in start + 2..=last {
        h[at(i, i - 2)] = 0.0;
        if i > start + 2 {
            h[at(i, i - 3)] = 0.0;
        }
    }
    // Without vectors only the active block has to be transformed.
    let (row_end, column_start) = if q.is_some() { (n, 0) } else { (last + 1, first) };
    for k in start..last {
        let three = k + 1 != last;
        if k != start {
            p = h[at(k, k - 1)];
            r = h[at(k + 1, k - 1)];
            s = if three { h[at(k + 2, k - 1)] } else { 0.0 };
        }
        // Scaled only where squares leave the range of numbers: quotients are what a sweep waits for.
        let mut square = p * p + r * r + s * s;
        let mut scale = 1.0;
        if !(square > LEAST_SQUARE && square < LARGEST_SQUARE) {
            scale = p.abs() + r.abs() + s.abs();
            if scale == 0.0 {
                continue;
            }
            (p, r, s) = (p / scale, r / scale, s / scale);
            square = p * p + r * r + s * s;
        }
        let length = p.signum() * square.sqrt();
        if k != start {
            h[at(k, k - 1)] = -length * scale;
        } else if first != start {
            h[at(k, k - 1)] = -h[at(k, k - 1)];
        }
        p += length;
        // Each quotient by a product: divisions are what a sweep waits for.
        let (by_length, by_first) = (1.0 / length, 1.0 / p);
        let (u0, u1, u2) = (p * by_length, r * by_length, s * by_length);
        let (v1, v2) = (r * by_first, s * by_first);
        let (u, v) = ([u0, u1, u2], [1.0, v1, v2]);
        reflect_rows(n, &mut h[k * n..], k..row_end, three, u, v);
        let bottom = last.min(k + 3);
        for row in h[column_start * n..(bottom + 1) * n].chunks_exact_mut(n) {
            if three && let Some([a, b, c]) = row.get_mut(k..k + 3) {
                let sum = u0 * *a + u1 * *b + u2 * *c;
                *a -= sum;
                *b -= sum * v1;
                *c -= sum * v2;
            } else if let Some([a, b]) = row.get_mut(k..k + 2) {
                let sum = u0 * *a + u1 * *b;
                *a -= sum;
                *b -= sum * v1;
            }
        }
        if let Some(q) = q.as_deref_mut() {
            reflect_rows(n, &mut q[k * n..], 0..n, three, v, u);
        }
    }
}

/// `row_i -= u_i (v' rows)` over some columns of the first three rows, or two.
#[inline(always)]
fn reflect_rows(
    n: usize,
    rows: &mut [f64],
    columns: Range<usize>,
    three: bool,
    u: [f64; 3],
    v: [f64; 3],
) {
    let (above, rest) = rows.split_at_mut(n);
    let (middle, below) = rest.split_at_mut(n);
    let (above, middle) = (&mut above[columns.clone()], &mut middle[columns.clone()]);
    if three {
        for ((a, b), c) in above.iter_mut().zip(middle).zip(&mut below[columns]) {
            let sum = v[0] * *a + v[1] * *b + v[2] * *c;
            *a -= sum * u[0];
            *b -= sum * u[1];
            *c -= sum * u[2];
        }
    } else {
        for (a, b) in above.iter_mut().zip(middle) {
            let sum = v[0] * *a + v[1] * *b;
            *a -= sum * u[0];
            *b -= sum * u[1];
        }
    }
}

/// The eigenvector of an upper quasi-triangular matrix `t(i, j)` that belongs to the diagonal block whose
/// last row is `last` (`pair`: of two rows), by back substitution. Rows below the block are zero.
pub(crate) fn quasi_triangular_vector(
    t: impl Fn(usize, usize) -> f64,
    value: Complex64,
    last: usize,
    pair: bool,
    smallest: f64,
    vector: &mut [Complex64],
) {
    vector.fill(Complex64::default());
    let mut top = last;
    vector[last] = 1.0.into();
    if pair {
        top -= 1;
        // The larger off-diagonal entry gives the better conditioned of the two equations.
        if t(last, top).abs() > t(top, last).abs() {
            vector[top] = (value - t(last, last)) / t(last, top);
        } else {
            vector[top] = 1.0.into();
            vector[last] = (value - t(top, top)) / t(top, last);
        }
    }
    let away_from_zero =
        |z: Complex64, floor: f64| if z.l1_norm() < floor { Complex64::from(floor) } else { z };
    while top > 0 {
        let i = top - 1;
        let load = |row: usize, vector: &[Complex64]| -> Complex64 {
            (top..=last).map(|j| t(row, j) * vector[j]).sum()
        };
        let rhs = -load(i, vector);
        let step;
        if i > 0 && t(i, i - 1) != 0.0 {
            let upper = -load(i - 1, vector);
            let (a, b) = (t(i - 1, i - 1) - value, t(i - 1, i));
            let (c, d) = (t(i, i - 1), t(i, i) - value);
            let determinant = away_from_zero(a * d - b * c, smallest * smallest);
            vector[i - 1] = (upper * d - rhs * b) / determinant;
            vector[i] = (a * rhs - upper * c) / determinant;
            step = 2;
        } else {
            vector[i] = rhs / away_from_zero(t(i, i) - value, smallest);
            step = 1;
        }
        let size = (top - step..top).map(|k| vector[k].l1_norm()).fold(0.0, f64::max);
        if size > GROWN {
            vector.iter_mut().for_each(|z| *z /= size);
        }
        top -= step;
    }
}
