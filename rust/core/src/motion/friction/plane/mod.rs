//! Friction in a plane: the direction of slip as a series, the error of that, the onset of slip, and its end.
//!
//! A contact that slips by w in a plane feels `T = -mu N e`, `e = w / |w|`. In the frame of the direction e_0 with which the panel
//! begins, `w = s^p (a, b)` with `a > 0`, and
//!
//! ```text
//! t = b / a,   c = (1 + t^2)^(-1/2),   e = (c, t c)
//! ```
//!
//! p is 0 while the contact slips. Slip begins with p = 1 where the friction force drops, as `w_1` is in balance with the forces R
//! on the contact, `M w' = R - mu N e`; where it does not (`|R| = mu N`), with p = 2: then e follows from the balance across e_0
//! in every order, and w from that along it. This series of p = 2 is an asymptotic one, taken on a panel that is short enough.
//!
//! *Error.* e is the gradient of the convex `|w|`, so `(w_1 - w_2) . (e_1 - e_2) >= 0`: a difference of two motions loses energy by
//! friction. In the energy norm (and where the norm is the largest entry, in that with `(w_x^2 + w_y^2)^(1/2)` in place of both
//! entries) only the defect of the series counts, no slope of e, however slow the slip is.
//!
//! *Friction over slip speed.* With a law mu(r), `r = |w| = w . e` is one more series, known from w and lower orders of e, and mu(r) one of
//! it. `mu(r) e` is the gradient of `int mu dr`, to which `f |w|^2 / 2` makes a convex one where `mu' >= -f` and `mu >= -f r`: then
//!
//! ```text
//! (w_1 - w_2) . (mu_1 e_1 - mu_2 e_2) >= -f |w_1 - w_2|^2
//! ```
//!
//! so that of the law only its fall counts, as a rate `N f / m` at which differences grow.
//!
//! *Slow slip.* The direction relaxes at the rate `mu N / (m r)`. Where this is fast, no series of t in time holds for longer; but the
//! direction that has relaxed follows from the balance across e_0, `mu N e = R - M w'` there with `w = a (1, t)`. Two terms of each order
//! come from the series before, which is formed again until nothing changes. What is left of this balance is the defect of that w,
//! whatever the rate.
//!
//! *End of slip.* With r = |w|, f = |R| and equal masses m, `r (mu N + R . e)` falls at the rate `((mu N)^2 - f^2) / m` while R is constant
//! (the energy and the momentum along R together), so that slip ends after `m r (mu N + R . e) / ((mu N)^2 - f^2)`. Panels shrink
//! with r, each until its series leaves out too much or about a tenth of its slip is left, until R is constant over that time to
//! rounding; the last one takes w to zero at a constant rate.

pub(crate) mod contact;
pub(super) mod errors;
pub(super) mod neighbour;
pub(super) mod series;
pub(super) mod widths;
