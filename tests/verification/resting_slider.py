"""A spring-held mass comes to rest on a resting slider.

``m x'' + k x = -mu N sign(x')``. While x' keeps its sign, the mass swings about ``-d sign(x')`` with ``d = mu
N / k`` and ``w = sqrt(k / m)``. Between two turning points it therefore takes ``pi / w``, and the distance
from the middle falls by 2 d. At the first turning point with ``|x| <= d`` the spring no longer overcomes
friction.
"""

import numpy as np

import stickslip as ss
from verification.block import block
from verification.case import Case, Quantity, decimal, mp


def turning_points(mass, stiffness, force, x, v):
    """Return time and place of every turning point, the place of rest last, for a start with ``v >= 0``.

    The first swing runs from phase ``atan2(v, (x - middle) w)`` to the turn. A start at rest is a turn.
    """
    mass, stiffness, force, x, v = map(decimal, (mass, stiffness, force, x, v))
    omega, offset = mp.sqrt(stiffness / mass), force / stiffness
    time = mp.mpf(0)
    if v > 0:
        middle = -offset
        time = mp.atan2(v / omega, x - middle) / omega
        x = middle + mp.hypot(x - middle, v / omega)
    points = [(time, x)]
    while abs(x) > offset:
        time += mp.pi / omega
        x = -(x - 2 * offset * mp.sign(x))
        points.append((time, x))
    return points


def computed(scene, start, duration):
    """Return times and places at which the slip velocity vanishes, and the state at the end."""
    run = ss.simulate(scene, duration, start)
    assert set(run.events.kind) == {"velocity"}
    return run.events.time, run.event_states()[0][:, 0], run.state(run.duration)


def code_aster():
    """Compare with SDND100."""
    mass, stiffness, friction, load, x = 1.0, 1e4, 0.1, 10.0, 8.5e-4
    points = turning_points(mass, stiffness, friction * load, x, 0.0)[1:]
    scene = block(mass=mass, stiffness=(stiffness, 0.0), load=load, friction=friction)
    times, places, end = computed(scene, ss.State([x, 0.0], [0.0, 0.0], "+"), 0.2)
    given = ["-6.5e-4", "4.5e-4", "-2.5e-4", "5.0e-5"]
    rows = [Quantity(name="half swings until rest", unit="", expected=len(points), computed=len(times))]
    for k, ((time, place), printed) in enumerate(zip(points, given, strict=True), 1):
        digits = "0.0314159265358979" if k == 1 else ""
        rows += [
            Quantity(
                name=f"time of turn {k}", unit="s", expected=time, computed=times[k - 1], reference=digits
            ),
            Quantity(
                name=f"x at turn {k}", unit="m", expected=place, computed=places[k - 1], reference=printed
            ),
        ]
    assert end.combination == "s"
    rest = points[-1][1]
    return [*rows, Quantity(name="x after 0.2 s", unit="m", expected=rest, computed=end.position[0])]


def siconos():
    """Compare with the friction oscillator."""
    x, v = 12.0, 6.0
    points = turning_points(1.0, 1.0, 1.0, x, v)
    scene = block(mass=1.0, stiffness=(1.0, 0.0), load=1.0, friction=1.0)
    times, places, end = computed(scene, ss.State([x, 0.0], [v, 0.0], "-"), 25.0)
    assert end.combination == "s"
    assert np.array_equal(end.position, [places[-1], 0.0])
    (first, peak), (last, rest) = points[0], points[-1]
    return [
        Quantity(name="turning points", unit="", expected=len(points), computed=len(times)),
        Quantity(
            name="time of turn 1", unit="s", expected=first, computed=times[0], reference="0.432407775571"
        ),
        Quantity(
            name="x at turn 1", unit="m", expected=peak, computed=places[0], reference="13.317821063276"
        ),
        Quantity(
            name="time of rest", unit="s", expected=last, computed=times[-1], reference="22.423556350699"
        ),
        Quantity(name="x at rest", unit="m", expected=rest, computed=places[-1], reference="0.682178936724"),
    ]


CASES = [
    Case(
        title="Coulomb slider coming to rest",
        source="Code_Aster validation manual V5.01.100, SDND100, analytical solution.",
        model=(
            "`m x'' + k x = -mu N sign(x')` with m = 1 kg, k = 1e4 N/m, mu = 0.1, N = 10 N, released at "
            "rest from x = 8.5e-4 m. Every half swing takes `pi sqrt(m / k)` and 2 mu N / k of the "
            "amplitude, until `|x| <= mu N / k`."
        ),
        tolerance="Closed form: 1e-12.",
        quantities=code_aster,
    ),
    Case(
        title="Friction oscillator",
        source="Siconos tutorials, `examples/mechanics/FrictionOscillator`; turning points in closed form.",
        model=(
            "`m x'' + k x = -R sign(x')` with m = 1 kg, k = 1 N/m, R = 1 N, from x = 12 m and x' = 6 m/s. "
            "The first swing goes on about `x = -R / k` from where the start is in its phase; then as "
            "above."
        ),
        tolerance="Closed form: 1e-12.",
        quantities=siconos,
    ),
]
