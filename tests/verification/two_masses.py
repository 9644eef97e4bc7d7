"""Two free masses, the first on a rough floor, pulled at the second until the load is removed.

Stuck: ``x2 = (F / k) (1 - cos(w t))`` with ``w = sqrt(k / m)``; the spring reaches ``mu_s N`` at ``cos(w t) =
1 - mu_s N / F``. Sliding forwards, with ``R = mu_d N``: the mean ``c = (x1 + x2) / 2`` has ``c'' = (F - R) /
(2 m)``, the stretch ``r = x2 - x1`` has ``r'' + (2 k / m) r = (F + R) / m``. Without the load F = 0 in both,
until ``x1' = c' - r' / 2`` vanishes.
"""

import stickslip as ss
from verification.case import Case, Quantity, decimal, mp

MASS, STIFFNESS, NORMAL, STATIC, KINETIC, PULL, REMOVED = 5.0, 1e4, 1e4, 0.3, 0.2, 3000.0, 0.2


def slide(force, c, c_rate, r, r_rate):
    """Return the motion (x1, x2, x1') over time while the first mass slides forwards."""
    m, k, friction = decimal(MASS), decimal(STIFFNESS), decimal(KINETIC) * decimal(NORMAL)
    pull, omega, middle = (force - friction) / (2 * m), mp.sqrt(2 * k / m), (force + friction) / (2 * k)

    def state(t):
        cos, sin = mp.cos(omega * t), mp.sin(omega * t)
        stretch = middle + (r - middle) * cos + r_rate / omega * sin
        stretch_rate = -(r - middle) * omega * sin + r_rate * cos
        mean, mean_rate = c + c_rate * t + pull * t**2 / 2, c_rate + pull * t
        return mean, mean_rate, stretch, stretch_rate

    return state


def first(state, end):
    """Return (x1, x2, x1') from mean and stretch."""
    mean, mean_rate, stretch, stretch_rate = state(end)
    return mean - stretch / 2, mean + stretch / 2, mean_rate - stretch_rate / 2


def closed_form():
    """Return onset, positions at 0.15 s, time of rest and positions there."""
    m, k, force = decimal(MASS), decimal(STIFFNESS), decimal(PULL)
    omega = mp.sqrt(k / m)
    onset = mp.acos(1 - decimal(STATIC) * decimal(NORMAL) / force) / omega
    x2, rate = force / k * (1 - mp.cos(omega * onset)), force / k * omega * mp.sin(omega * onset)
    pulled = slide(force, x2 / 2, rate / 2, x2, rate)
    at_150_ms = first(pulled, mp.mpf("0.15") - onset)[:2]
    removed = decimal(REMOVED)
    free = slide(mp.mpf(0), *pulled(removed - onset))
    # In steps of 1 ms, 1 / 100 of the period of the stretch, the first sign change brackets the first zero.
    step = mp.mpf("0.001")
    n = next(n for n in range(1000) if first(free, (n + 1) * step)[2] < 0)
    rest = mp.findroot(lambda t: first(free, t)[2], (n * step, (n + 1) * step), solver="anderson", tol=1e-60)
    return onset, *at_150_ms, removed + rest, *first(free, rest)[:2]


def scene():
    """Return the two masses under the pull; y is the normal direction of the first one."""
    floor = ss.Contact(tangential="x1", normal="y", friction=KINETIC, static_friction=STATIC)
    stiffness = [[STIFFNESS, -STIFFNESS, 0.0], [-STIFFNESS, STIFFNESS, 0.0], [0.0, 0.0, 0.0]]
    force, dofs = [0.0, 0.0, -NORMAL], ["x1", "x2", "y"]
    pull = ss.Switched({"x2": PULL}, times=[REMOVED], values=[1.0, 0.0])
    return ss.Scene([MASS] * 3, stiffness, force=force, contacts=[floor], dofs=dofs, loads=[pull])


def quantities():
    """Compare with SDND106."""
    onset, x1, x2, rest, x1_rest, x2_rest = closed_form()
    run = ss.simulate(scene(), REMOVED + 0.13, ss.State([0.0] * 3, [0.0] * 3, "s"))
    assert run.events.kind[:3].tolist() == ["slip-", "load", "velocity"]
    assert run.events.combination[:3].tolist() == ["-", "-", "s"]
    assert run.events.time[1] == REMOVED
    later, stopped = run.state(0.15).position, run.event_states()[0][2]
    rows = [
        ("onset of slip", "s", onset, run.events.time[0], "0.0351240736552036"),
        ("x1 at 0.15 s", "m", x1, later[0], "1.3533376608929"),
        ("x2 at 0.15 s", "m", x2, later[1], "1.80753246617595"),
        ("sticks again", "s", rest, run.events.time[2], "0.314923275447487"),
        ("x1 when it sticks", "m", x1_rest, stopped[0], ""),
        ("x2 when it sticks", "m", x2_rest, stopped[1], ""),
    ]
    return [
        Quantity(name=name, unit=unit, expected=expected, computed=computed, reference=reference)
        for name, unit, expected, computed, reference in rows
    ]


CASES = [
    Case(
        title="Two masses, static and kinetic friction, load removed",
        source="Code_Aster validation manual V5.01.106, SDND106; closed form.",
        model=(
            "Two free masses of 5 kg with a spring k = 1e4 N/m between them, at rest. The first is pressed "
            "on a floor with N = 1e4 N, static friction 0.3, kinetic 0.2; F = 3000 N pulls the second "
            "until 0.2 s. Stuck, `x2 = (F / k)(1 - cos(w t))`; sliding, `(x1 + x2)'' = (F - mu N) / m` and "
            "`r'' + (2 k / m) r = (F + mu N) / m` for `r = x2 - x1`. The load is `Switched` off at 0.2 s."
        ),
        tolerance="Closed form, the time of rest as a zero of it in 40 digits: 1e-12.",
        quantities=quantities,
    )
]
