"""The minimal model of mode coupling: one mass on two inclined springs and a contact spring.

A mass m hangs on springs k1, k2 at angles 150 and 30 degrees and presses on a belt through the spring k3.
Friction follows the force of k3, and moves the off-diagonal stiffness: with ``k1 = 2/3 (2 - sqrt 3)``, ``k2 =
2/3 (2 + sqrt 3)``, k3 = 4/3 the sums ``sum k_i cos^2``, ``sum k_i sin cos``, ``k3 + sum k_i sin^2`` are 2, 1,
2 and

    m (x, y)'' + [[2, 1 - D], [1, 2]] (x, y) = 0,   D = k3 mu.

With C = c M, ``lambda^2 + c lambda + 2 +- sqrt(1 - D) = 0``. Without damping the modes merge at D = 1, at
``lambda = i sqrt 2``, and beyond it one grows. With damping and ``s = sqrt(D - 1)`` the limit ``lambda = i
w`` asks ``w^2 = 2`` and ``c w = s``: D = 1 + 2 c^2, at the same frequency.

In the scene the contact spring ends in a dof n that is the normal direction; its mass does not matter while
the contact stays closed. ``T = -mu N`` with ``N = P - k3 y`` on x is the off-diagonal term of the published
model: sliding with combination ``-``, on a belt that moves backwards.
"""

from functools import partial

import numpy as np

import stickslip as ss
from verification.case import Case, Quantity, decimal, mp

DAMPING = 0.1


def eigenvalues(friction, damping):
    """Return the eigenvalues with positive imaginary part, by imaginary part, in 40 digits."""
    shift = mp.sqrt(mp.mpc(1 - mp.mpf(4) / 3 * decimal(friction)))
    c = decimal(damping)
    pairs = [-c / 2 + mp.mpc(0, 1) * mp.sqrt(2 + sign * shift - c**2 / 4) for sign in (-1, 1)]
    return sorted(pairs, key=lambda value: (value.imag, value.real))


def undamped():
    """Compare the point at which the modes merge, and eigenvalues before and beyond it."""
    points = ss.critical_points(ss.models.hoffmann, {"friction": (0.0, 1.4)}, combination="-")
    (merge,) = [point for point in points if point.kind == "lock_in"]
    rows = [
        Quantity(name="friction where the modes merge", unit="", expected=0.75, computed=merge.value),
        Quantity(name="their frequency", unit="rad/s", expected=mp.sqrt(2), computed=abs(merge.eigenvalue)),
    ]
    for friction in (0.0, 0.5):
        computed = np.sort(upper(friction, 0.0).imag)
        for n, value in enumerate(eigenvalues(friction, 0.0)):
            name = f"frequency {n + 1} at friction {friction:g}"
            rows.append(Quantity(name=name, unit="rad/s", expected=value.imag, computed=computed[n]))
    fastest = upper(1.5, 0.0).real.max()
    growth = eigenvalues(1.5, 0.0)[-1].real
    return [
        *rows,
        Quantity(name="growth at friction 1.5", unit="1/s", expected=abs(growth), computed=fastest),
    ]


def upper(friction, damping):
    """Return the computed eigenvalues with positive imaginary part."""
    return ss.complex_modes(ss.models.hoffmann(friction=friction, damping=damping), "-").eigenvalues


def damped():
    """Compare the Hopf point with damping proportional to mass."""
    c = decimal(DAMPING)
    model = partial(ss.models.hoffmann, damping=DAMPING)
    points = ss.critical_points(model, {"friction": (0.0, 1.4)}, combination="-")
    (hopf,) = [point for point in points if point.kind == "hopf"]
    limit = mp.mpf(3) / 4 * (1 + 2 * c**2)
    growth = max(value.real for value in eigenvalues(1.0, DAMPING))
    # (s^2 + c s + 2) (s^2 + d s + 2) = 1 - D has s = i sqrt 2 where D = 1 + 2 c d.
    unlike = partial(ss.models.hoffmann, damping=(DAMPING, 3.0 * DAMPING))
    (second,) = ss.critical_points(unlike, {"friction": (0.0, 1.4)}, kinds=("hopf",))
    return [
        Quantity(
            name="friction at the limit, dampers c and 3 c",
            unit="",
            expected=mp.mpf(3) / 4 * (1 + 6 * c**2),
            computed=second.value,
        ),
        Quantity(name="friction at the limit", unit="", expected=limit, computed=hopf.value),
        Quantity(
            name="frequency there", unit="rad/s", expected=mp.sqrt(2), computed=abs(hopf.eigenvalue.imag)
        ),
        Quantity(
            name="growth at friction 1", unit="1/s", expected=growth, computed=upper(1.0, DAMPING).real.max()
        ),
    ]


CASES = [
    Case(
        title="Mode coupling, minimal model",
        source=(
            "Hoffmann, Fischer, Allgaier, Gaul, *A minimal model for studying properties of the "
            "mode-coupling type instability in friction induced oscillations*, Mechanics Research "
            "Communications 29, 2002; closed form."
        ),
        model=(
            "A mass of 1 kg on springs 2/3 (2 - sqrt 3) N/m at 150 degrees and 2/3 (2 + sqrt 3) N/m at 30 "
            "degrees, pressed on a belt by a contact spring of 4/3 N/m: `(x, y)'' + [[2, 1 - D], [1, 2]] "
            "(x, y) = 0`, D = 4/3 mu, so `lambda^2 = -2 +- sqrt(1 - D)`. The two frequencies merge at D = "
            "1; beyond it one mode grows."
        ),
        tolerance="Closed form: 1e-12.",
        quantities=undamped,
    ),
    Case(
        title="Mode coupling with damping",
        source=(
            "Hoffmann, Gaul, *Effects of damping on mode-coupling instability in friction induced "
            "oscillations*, ZAMM 83, 2003, for damping of both directions alike; closed form."
        ),
        model=(
            "The same with C = c M, c = 0.1 1/s: `lambda^2 + c lambda + 2 +- sqrt(1 - D) = 0`. Steady "
            "sliding loses stability at D = 1 + 2 c^2 with `lambda = i sqrt 2`; with dampers c and d of x "
            "and y at D = 1 + 2 c d."
        ),
        tolerance="Closed form: 1e-12.",
        quantities=damped,
    ),
]
