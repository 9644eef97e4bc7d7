"""A mass on a rough plate that shakes.

The plate has the acceleration `a sin(2 pi t)` from rest, so the speed `V = a / (2 pi) (1 - cos(2 pi t))`. The
mass sticks while `|a sin(2 pi t)| <= mu N / m`; while it slips its speed changes by +-mu N / m. All is known
but the times at which slip ends, which are zeros of `u - V`.
"""

import stickslip as ss
from verification.case import Case, Quantity, decimal, mp

FRICTION, NORMAL, BEGIN, END = 0.1, 10.0, 4.0, 12.0
#: Acceleration of the plate, m/s^2, and the mean of N |s| known before.
CASES_OF = ((15.0, "15.2670995894"), (1.5, "0.409062451016"), (0.99, "0"))
#: Steps per second in which the end of a slip is looked for.
STEPS = 200


def mean_wear(acceleration):
    """Return the mean of N |s| from 4 s to 12 s in 40 digits."""
    a, grip = decimal(acceleration), decimal(FRICTION) * decimal(NORMAL)

    def plate(t):
        return a / (2 * mp.pi) * (1 - mp.cos(2 * mp.pi * t))

    def travelled(t):
        return a / (2 * mp.pi) * (t - mp.sin(2 * mp.pi * t) / (2 * mp.pi))

    if a <= grip:
        return mp.mpf(0)
    first = mp.asin(grip / a) / (2 * mp.pi)
    time, sign, wear = first, 1, mp.mpf(0)
    while time < END:
        # The plate runs ahead of the mass (sign 1) or behind it.
        begun, speed = time, plate(time)

        def slip(t, begun=begun, speed=speed, sign=sign):
            return sign * (plate(t) - speed) - grip * (t - begun)

        step = mp.mpf(1) / STEPS
        n = next(n for n in range(1, 100 * STEPS) if slip(begun + n * step) < 0)
        bracket = (begun + (n - 1) * step, begun + n * step)
        if n == 1:
            bracket = (begun + step / 1000, begun + step)
        time = mp.findroot(slip, bracket, solver="anderson", tol=1e-60)

        def passed(t, begun=begun, speed=speed, sign=sign):
            return (
                sign * (travelled(t) - travelled(begun) - speed * (t - begun)) - grip * (t - begun) ** 2 / 2
            )

        low, high = max(begun, mp.mpf(BEGIN)), min(time, mp.mpf(END))
        if high > low:
            wear += decimal(NORMAL) * (passed(high) - passed(low))
        pull = a * mp.sin(2 * mp.pi * time)
        if abs(pull) > grip:
            sign = 1 if pull > 0 else -1
            continue
        # It sticks until the plate pulls harder than friction: next at the end of its half period.
        half = mp.floor(2 * time)
        ahead = half / 2 + first
        time = ahead if ahead > time else ahead + mp.mpf(1) / 2
        sign = 1 if mp.sin(2 * mp.pi * time) > 0 else -1
    return wear / (END - BEGIN)


def computed(acceleration):
    """Return the same by a run of 12 s."""
    amplitude = acceleration / (2.0 * float(mp.pi))
    shaking = ss.Harmonic(-amplitude, frequency=1.0)
    plate = ss.Contact(
        tangential="x",
        friction=FRICTION,
        normal_force=NORMAL,
        slider_speed=amplitude,
        slider_vibration=shaking,
    )
    scene = ss.Scene([1.0], [[0.0]], contacts=[plate], dofs=["x"])
    run = ss.simulate(scene, END, ss.State([0.0], [0.0], "s"))
    return float(run.balance(BEGIN, END).contacts.wear.sum()) / (END - BEGIN)


def quantities():
    """Compare the mean wear power."""
    return [
        Quantity(
            name=f"mean of N |s|, a = {acceleration:g} m/s^2",
            unit="W",
            expected=mean_wear(acceleration),
            computed=computed(acceleration),
            reference=known,
        )
        for acceleration, known in CASES_OF
    ]


CASES = [
    Case(
        title="Mass on a shaking plate, wear",
        source="Code_Aster validation manual V5.01.104, SDND104; closed form.",
        model=(
            "A mass of 1 kg, pressed on a plate with N = 10 N, friction 0.1; the plate has the acceleration "
            "a sin(2 pi t) from rest. The slider has the constant speed a / (2 pi) and vibrates with "
            "- a / (2 pi) cos(2 pi t). While the mass slips its speed changes by mu N / m in a second; "
            "Archard's law takes the mean of N |s| from 4 s to 12 s."
        ),
        tolerance="Closed form, the ends of slip as zeros of it in 40 digits: 1e-12.",
        quantities=quantities,
    )
]
