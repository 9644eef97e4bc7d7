"""Mode coupling with a cubic contact spring: a subcritical Hopf point, and the cycles beyond its fold.

About steady sliding, with ``phi = 4/3 y + kn y^3``,

    x'' + c x' + 2 x + y - mu phi = 0,   y'' + c y' + x + 2/3 y + phi = 0.

The Hopf point is that of the linear model, ``mu = 3/4 (1 + 2 c^2)``. Orbits without events are fixed points
of the map from one largest y to the next, here by Taylor series and Newton's method in 40 digits.
"""

from functools import cache, partial

import numpy as np

import stickslip as ss
from verification.case import Case, Quantity, decimal, mp
from verification.taylor import closed_orbit, product, until

DAMPING, CUBIC = 0.1, 1.0
#: The contact stays closed and the mass slips: phi comes to 23 N, x' to 6 m/s.
model = partial(ss.models.hoffmann, damping=DAMPING, cubic=CUBIC, preload=50.0, slider_speed=-100.0)
#: Penetration of steady sliding where the same spring is the stiffness of the contact.
PRESSED = 3.0


def on_a_stiffness(friction):
    """Return the model with a law of the contact stiffness: ``N = phi(u)``, u = p - y.

    ``phi(u) = 4/3 u + kn ((u - p)^3 + p^3)`` is positive for u > 0, and ``N - N_0 = -4/3 y - kn y^3``.
    """
    law = ss.spring.Law(
        lambda u, soft=4.0 / 3.0, hard=CUBIC, pressed=PRESSED: (
            soft * u + hard * ((u - pressed) ** 3 + pressed**3)
        )
    )
    contact = ss.Contact(
        tangential="x", normal="y", friction=friction, slider_speed=-100.0, gap=-PRESSED, normal_stiffness=law
    )
    normal = law.force(PRESSED)
    force = [friction * normal, -normal]
    stiffness = [[2.0, 1.0], [1.0, 2.0 / 3.0]]
    return ss.Scene([1.0, 1.0], stiffness, DAMPING * np.eye(2), force, [contact], dofs=["x", "y"])


#: Friction with x, y and x' at the largest y, and period, all to the digits that were known before.
ORBITS = {
    0.8: ("-3.37510688174579", "2.11978586044956", "0.738843274206283", "3.30588827498029"),
    1.0: ("-5.11981542921528", "2.44371848455904", "0.967402272586592", "3.09385449120131"),
}
#: Friction at the fold.
FOLD = "0.5457499619"


@cache
def orbit(friction):
    """Return x, y and x' at the largest y, period, and the largest modulus of a multiplier beside 1."""
    mu, c, hard = map(decimal, (friction, DAMPING, CUBIC))

    def rates(rows, k):
        x, y, u, v = rows[:4]
        if k == 0:
            rows[4:] = [[], []]
        square, cube = rows[4:]
        square.append(product(y, y, k))
        cube.append(product(square, y, k))
        spring = mp.mpf(4) / 3 * y[k] + hard * cube[k]
        return [
            u[k],
            v[k],
            -c * u[k] - 2 * x[k] - y[k] + mu * spring,
            -c * v[k] - x[k] - mp.mpf(2) / 3 * y[k] - spring,
        ]

    def round_trip(place):
        x, y, u = place
        return until(rates, [x, y, u, mp.mpf(0)], lambda state: state[3], step=mp.mpf("0.1"), after=2)

    place, jacobian = closed_orbit(lambda place: round_trip(place)[1][:3], ORBITS[friction][:3], steps=3)
    multipliers = mp.eig(jacobian, left=False, right=False)
    return *place, round_trip(place)[0], max(abs(one) for one in multipliers)


def quantities():
    """Compare the Hopf point, two cycles and the fold."""
    (hopf,) = ss.critical_points(model, {"friction": (0.5, 1.0)}, kinds=("hopf",))
    assert hopf.criticality == "subcritical"
    (stiff,) = ss.critical_points(on_a_stiffness, {"friction": (0.5, 1.0)}, kinds=("hopf",))
    assert stiff.criticality == "subcritical"
    rows = [
        Quantity(
            name=f"friction at the Hopf point{of}",
            unit="",
            expected=mp.mpf(3) / 4 * (1 + 2 * decimal(DAMPING) ** 2),
            computed=point.value,
            reference="0.765",
        )
        for of, point in (("", hopf), (", by a contact stiffness", stiff))
    ]
    for friction, (x, y, u, known) in ORBITS.items():
        start = ss.State([float(x), float(y), 0.0], [float(u), 0.0, 0.0], "-")
        cycle = ss.simulate(model(friction=friction), 3.0 * float(known), start).limit_cycle(further=100.0)
        assert cycle.stable
        _, largest, _, period, multiplier = orbit(friction)
        beside = sorted(np.abs(cycle.multipliers))[-2]
        named = f"at friction {friction:g}"
        start = ss.State([float(x), float(y)], [float(u), 0.0], "-")
        pressed = ss.simulate(on_a_stiffness(friction), 3.0 * float(known), start)
        stiff = pressed.limit_cycle(further=100.0)
        rows += [
            Quantity(
                name=f"period {named}", unit="s", expected=period, computed=cycle.period, reference=known
            ),
            Quantity(
                name=f"largest y {named}",
                unit="m",
                expected=largest,
                computed=float(cycle.maximum.sel(dof="y")),
                reference=y,
            ),
            Quantity(
                name=f"period {named}, by a contact stiffness",
                unit="s",
                expected=period,
                computed=stiff.period,
                reference=known,
            ),
            Quantity(
                name=f"largest multiplier beside 1 {named}, by a contact stiffness",
                unit="",
                expected=multiplier,
                computed=float(sorted(np.abs(stiff.multipliers))[-2]),
                relative=1e-10,
            ),
            Quantity(
                name=f"largest multiplier beside 1 {named}",
                unit="",
                expected=multiplier,
                computed=float(beside),
                relative=1e-10,
            ),
        ]
    branch = ss.continuation(cycle, {"friction": (1.0, 0.5)}, lambda friction: model(friction=friction))
    rows.append(
        Quantity(
            name="friction at the fold",
            unit="",
            expected=mp.mpf(FOLD),
            computed=branch.folds[0].value,
            reference=FOLD,
            relative=2e-10,
        )
    )
    return rows


CASES = [
    Case(
        title="Mode coupling with a cubic contact spring",
        source=(
            "The minimal model of Hoffmann, Fischer, Allgaier, Gaul (2002) with a cubic contact spring, as "
            "in studies of nonlinear brakes; cycles by their equation of motion in 40 digits."
        ),
        model=(
            "`x'' + c x' + 2 x + y - mu phi = 0`, `y'' + c y' + x + 2/3 y + phi = 0`, `phi = 4/3 y + y^3`, "
            "c = 0.1, on a belt so fast that the mass never sticks. The Hopf point at `mu = 3/4 (1 + 2 c^2)` "
            "is subcritical: an unstable cycle leads back to a fold, and beyond it a stable one is there on "
            "both sides of the Hopf point. *By a contact stiffness*: the same spring as "
            "`normal_stiffness=` of a contact without mass, pressed by 3 m in steady sliding."
        ),
        tolerance="40 digits: 1e-12, multipliers 1e-10; the fold to the ten digits that are known.",
        quantities=quantities,
    )
]
