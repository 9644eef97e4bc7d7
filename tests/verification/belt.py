"""The stick-slip cycle of a block on a belt with constant static and kinetic friction.

The belt carries the block to ``x = Fs / k``. From there ``m x'' + k x = Fd``: with ``a = (Fs - Fd) / k`` and
``w = sqrt(k / m)`` it slips as ``x = Fd / k + a cos(w t) + (V / w) sin(w t)``, so its largest displacement is
``Fd / k + sqrt(a^2 + (V / w)^2)``. The condition ``x' = V`` is ``cos(w t) - 1 = (a w / V) sin(w t)``, that is
``tan(w t / 2) = -a w / V``: it is caught after ``(2 / w) (pi - atan(a w / V))``, at ``x = Fd / k - a``. The
belt then carries it for ``2 a / V``.
"""

import stickslip as ss
from verification.case import Case, Quantity, decimal, mp


def compared(mass, stiffness, static, kinetic, speed, period, largest):
    """Compare the cycle that a run from the relaxed spring settles to with the closed form."""
    scene = ss.models.mass_on_belt(
        mass=mass,
        stiffness=stiffness,
        damping=0.0,
        normal_force=1.0,
        friction=kinetic,
        static_friction=static,
        slider_speed=speed,
    )
    m, k, high, low, v = map(decimal, (mass, stiffness, static, kinetic, speed))
    omega, a = mp.sqrt(k / m), (high - low) / k
    stick, slip = 2 * a / v, 2 / omega * (mp.pi - mp.atan(a * omega / v))
    start = ss.State([0.0], [speed], "s")
    cycle = ss.simulate(scene, 4.0 * float(stick + slip), start).limit_cycle()
    durations = dict(zip(cycle.combinations, cycle.durations, strict=True))
    extent = (low / k + mp.hypot(a, v / omega), low / k - mp.hypot(a, v / omega))
    return [
        Quantity(name="period", unit="s", expected=stick + slip, computed=cycle.period, reference=period),
        Quantity(name="time of sticking", unit="s", expected=stick, computed=durations["s"]),
        Quantity(name="time of slip", unit="s", expected=slip, computed=durations["+"]),
        Quantity(
            name="largest x",
            unit="m",
            expected=extent[0],
            computed=cycle.maximum[0].item(),
            reference=largest,
        ),
        Quantity(
            name="smallest x",
            unit="m",
            expected=extent[1],
            computed=cycle.minimum[0].item(),
            # It is a difference of terms as large as the largest x.
            absolute=1e-12 * float(extent[0]),
        ),
    ]


def unit_block():
    """Compare for unit mass and stiffness."""
    return compared(1.0, 1.0, 1.0, 0.5, 0.1, "13.5363837732896", "1.00990195135928")


def stiff_block():
    """Compare where every number differs from one."""
    return compared(2.0, 50.0, 12.0, 8.0, 0.3, "1.41905230756861", "0.26")


MODEL = (
    "`m x'' + k x = Fd` while the block slips behind the belt of speed V, x' = V while `|k x| <= Fs`; {}. "
    "The block sticks for `2 (Fs - Fd) / (k V)` and slips for `(2 / w) (pi - atan((Fs - Fd) w / (k V)))`, "
    "`w = sqrt(k / m)`; it reaches `Fd / k + sqrt(((Fs - Fd) / k)^2 + (V / w)^2)`. Computed by "
    "`limit_cycle`."
)
SOURCE = "Classical stick-slip with constant static and kinetic friction (Blok 1940); closed form."

CASES = [
    Case(
        title="Block on a belt",
        source=SOURCE,
        model=MODEL.format("m = 1 kg, k = 1 N/m, Fs = 1 N, Fd = 0.5 N, V = 0.1 m/s"),
        tolerance="Closed form: 1e-12; the smallest x relative to the largest, as it is a difference.",
        quantities=unit_block,
    ),
    Case(
        title="Block on a belt, second set",
        source=SOURCE,
        model=MODEL.format("m = 2 kg, k = 50 N/m, Fs = 12 N, Fd = 8 N, V = 0.3 m/s"),
        tolerance="As above.",
        quantities=stiff_block,
    ),
]
