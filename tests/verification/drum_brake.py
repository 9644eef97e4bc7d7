"""A drum brake of two modes that friction couples: damping of the modes destabilises.

Modes of 100 and 75 Hz, with the friction of the shoes as an unsymmetric stiffness, and a loss factor eta:

    x1'' + eta w1 x1' + w1^2 x1 - mu w2^2 x2 = 0,   x2'' + eta w2 x2' + mu w1^2 x1 + w2^2 x2 = 0.

The determinant of ``lambda^2 + lambda C + K + H`` is

    lambda^4 + eta (w1 + w2) lambda^3 + (w1^2 + w2^2 + eta^2 w1 w2) lambda^2 + eta w1 w2 (w1 + w2) lambda
        + w1^2 w2^2 (1 + mu^2).

At ``lambda = i w`` its imaginary part asks ``w^2 = w1 w2``, whatever the loss factor, and its real part then
``mu^2 = (w1 - w2)^2 / (w1 w2) + eta^2``. Without damping ``lambda^2`` are the roots of a quadratic equation,
which meet at ``mu = (w1^2 - w2^2) / (2 w1 w2)`` = 7/24: later than with a little damping.

The unsymmetric matrix is given as `circulatory`, by a function of friction.
"""

from functools import partial

import numpy as np

import stickslip as ss
from verification.case import Case, Quantity, decimal, mp

FIRST, SECOND, LOSS = 100.0, 75.0, 0.02


def drum_brake(friction, loss=LOSS):
    """Return the scene; friction fills the circulatory matrix."""
    first, second = 2.0 * np.pi * FIRST, 2.0 * np.pi * SECOND
    return ss.Scene(
        [1.0, 1.0],
        np.diag([first**2, second**2]),
        damping=np.diag([loss * first, loss * second]) if loss else None,
        circulatory=friction * np.array([[0.0, -(second**2)], [first**2, 0.0]]),
    )


def eigenvalues(friction, loss):
    """Return the roots of the characteristic polynomial with positive imaginary part, by it, in 40 digits."""
    first, second = 2 * mp.pi * decimal(FIRST), 2 * mp.pi * decimal(SECOND)
    eta, mu = decimal(loss), decimal(friction)
    both = first * second
    # In units of the geometric mean of both; the last row of the companion matrix.
    unit = mp.sqrt(both)
    companion = mp.matrix(4)
    for k in range(3):
        companion[k, k + 1] = 1
    middle = eta * (first + second) / unit
    squares = (first**2 + second**2) / both + eta**2
    for k, coefficient in enumerate((1 + mu**2, middle, squares, middle)):
        companion[3, k] = -coefficient
    roots = [unit * root for root in mp.eig(companion, left=False, right=False)]
    return sorted((root for root in roots if root.imag > 0), key=lambda root: root.imag)


def stability():
    """Compare the Hopf point, the lock-in without damping, and eigenvalues before and beyond them."""
    (hopf,) = ss.critical_points(drum_brake, {"friction": (0.0, 0.5)}, kinds=("hopf",))
    (lock_in,) = ss.critical_points(partial(drum_brake, loss=0.0), {"friction": (0.0, 0.5)})
    ratio = decimal(FIRST) / decimal(SECOND)
    limit = mp.sqrt(ratio - 2 + 1 / ratio + decimal(LOSS) ** 2)
    rows = [
        Quantity(
            name="friction at the Hopf point",
            unit="",
            expected=limit,
            computed=hopf.value,
            reference="0.289367125522809",
        ),
        Quantity(
            name="frequency there",
            unit="Hz",
            expected=mp.sqrt(decimal(FIRST) * decimal(SECOND)),
            computed=hopf.frequency,
            reference="86.6025403784",
        ),
        Quantity(
            name="friction at which the undamped modes meet",
            unit="",
            expected=mp.mpf(7) / 24,
            computed=lock_in.value,
        ),
    ]
    for friction in (0.2, 0.35):
        values = ss.complex_modes(drum_brake(friction)).eigenvalues
        computed = sorted(values, key=lambda value: value.imag)
        for n, (expected, value) in enumerate(zip(eigenvalues(friction, LOSS), computed, strict=True)):
            place = f"mode {n + 1} at friction {friction:g}"
            rows.append(
                Quantity(name=f"growth of {place}", unit="1/s", expected=expected.real, computed=value.real)
            )
            rows.append(
                Quantity(
                    name=f"frequency of {place}", unit="rad/s", expected=expected.imag, computed=value.imag
                )
            )
    return rows


CASES = [
    Case(
        title="Drum brake with two modes",
        source=(
            "The two-mode brake in which modal damping destabilises: Hultén, *Brake squeal - a self-exciting "
            "mechanism with constant friction*, SAE 932965, 1993; with these equations and frequencies "
            "Sinou, Jézéquel, *Mode coupling instability in friction-induced vibrations and its dependency "
            "on system parameters including damping*, European Journal of Mechanics A 26, 2007; closed form."
        ),
        model=(
            "Unit modal masses, w1 = 2 pi 100 1/s, w2 = 2 pi 75 1/s, eta = 0.02: `x1'' + eta w1 x1' + "
            "w1^2 x1 - mu w2^2 x2 = 0`, `x2'' + eta w2 x2' + mu w1^2 x1 + w2^2 x2 = 0`. Friction is the "
            "circulatory matrix. Steady sliding loses stability at `mu^2 = (w1 - w2)^2 / (w1 w2) + eta^2` "
            "with `w^2 = w1 w2`, before the undamped modes meet at 7/24."
        ),
        tolerance="Closed form: 1e-12.",
        quantities=stability,
    ),
]
