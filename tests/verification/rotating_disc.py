"""Two modes of a rotating disc with friction of its pads: which wave grows, and from where on.

With z the complex number of both coordinates ``z'' + (D + 2 i n W) z' + (w^2 - n^2 W^2 + i p) z = 0``. With
``z = exp((s - i n W) t)``: ``s^2 + D s + w^2 - i D n W + i p = 0``. At ``s = i q`` the real part asks ``q =
+-w``, and the imaginary part ``p = D (n W - q)``: the wave with the angular frequency w + n W grows beyond
``p = D (w + n W)``, that with w - n W below ``p = -D (w - n W)``.
"""

from functools import partial

import numpy as np

import stickslip as ss
from verification.case import Case, Quantity, decimal, mp

FREQUENCY, DIAMETERS, SPEED, DAMPING = 100.0, 4, 5.0, 2.0
model = partial(
    ss.models.rotating_disc, frequency=FREQUENCY, diameters=DIAMETERS, speed=SPEED, damping=DAMPING
)


def quantities():
    """Compare both limits with their frequencies, and eigenvalues between and beyond them."""
    rate, turning = 2 * mp.pi * decimal(FREQUENCY), DIAMETERS * decimal(SPEED)
    damping = decimal(DAMPING)
    rows = []
    for side, name in ((1, "that runs with n W"), (-1, "that runs against it")):
        limit = side * damping * (rate + side * turning)
        ends = sorted((0.5 * float(limit), 2.0 * float(limit)))
        (point,) = ss.critical_points(model, {"follower_stiffness": tuple(ends)}, kinds=("hopf",))
        rows += [
            Quantity(name=f"limit of the wave {name}", unit="1/s^2", expected=limit, computed=point.value),
            Quantity(
                name="its frequency",
                unit="Hz",
                expected=(rate + side * turning) / (2 * mp.pi),
                computed=point.frequency,
            ),
        ]
    for follower in (600.0, 2000.0):
        shift = damping**2 / 4 - rate**2 + mp.mpc(0, 1) * (damping * turning - decimal(follower))
        roots = [sign * mp.sqrt(shift) - damping / 2 - mp.mpc(0, turning) for sign in (1, -1)]
        # z rotates one way or the other; modes are listed by their frequency.
        expected = sorted(((root.real, abs(root.imag)) for root in roots), key=lambda pair: pair[1])
        computed = ss.complex_modes(model(follower_stiffness=follower)).eigenvalues
        for k, value in enumerate(computed[np.argsort(computed.imag)]):
            named = f"of wave {k + 1} at p = {follower:g}"
            rows += [
                Quantity(
                    name=f"growth {named}",
                    unit="1/s",
                    expected=expected[k][0],
                    computed=value.real,
                    # It is a part of an eigenvalue that is hundreds of times as large.
                    absolute=1e-12 * float(rate),
                ),
                Quantity(
                    name=f"angular frequency {named}",
                    unit="rad/s",
                    expected=expected[k][1],
                    computed=value.imag,
                ),
            ]
    return rows


CASES = [
    Case(
        title="Two travelling modes of a rotating disc",
        source=(
            "O. N. Kirillov, *How to play a disc brake*, arXiv:0708.0967, 2007, for a doublet of modes with "
            "gyroscopic, dissipative and circulatory forces; closed form for equal damping of both modes."
        ),
        model=(
            "`x'' + (D + 2 n W J) x' + (w^2 - n^2 W^2 + p J) x = 0`, `J = [[0, -1], [1, 0]]`; w = 2 pi 100 "
            "1/s, n = 4, W = 5 1/s, D = 2 1/s. The waves of the angular frequencies w + n W and w - n W "
            "grow beyond `p = D (w + n W)` and `p = -D (w - n W)`."
        ),
        tolerance="Closed form: 1e-12, growth rates relative to the natural frequency.",
        quantities=quantities,
    )
]
