"""The nonlinear mode of an oscillator with a Jenkins element, as a branch of limit cycles.

The extended periodic motion concept (Krack 2015) asks for the delta for which
``x'' - delta x' + x + J(x) = 0`` has a periodic motion of amplitude X: the energy that delta feeds in a
period is what friction takes. J is the force of a spring k_t that slides at the force F. On the way down from
X, the element sticks over 2 F / k_t, ``x'' - delta x' + (1 + k_t) x = k_t X - F``, then slides,
``x'' - delta x' + x = F``, and comes to rest at -X. The durations of both parts and delta follow from these
two conditions and the place where the element gives way; the angular frequency is pi over the sum of the
durations.
"""

import numpy as np

import stickslip as ss
from verification.case import Case, Quantity, mp

STIFFNESS, LIMIT = "0.25", "0.2"
#: By amplitude: angular frequency and delta.
REFERENCES = {
    "1.0": ("1.101987871265432", "0.04606413733289027"),
    "1.2": ("1.084969563824875", "0.06500865363702359"),
    "2.0": ("1.045742254296054", "0.0731851140943643"),
    "5.0": ("1.012800836915931", "0.04238872850857398"),
    "10.0": ("1.004650960147076", "0.02336768055219621"),
}
LARGEST = "0.075129049455762"


def moved(place, velocity, stiffness, force, delta, duration):
    """Return place and velocity after a duration of ``x'' - delta x' + stiffness x = force``."""
    mean, rate = force / stiffness, mp.sqrt(stiffness - delta**2 / 4)
    start = place - mean
    slope = (velocity - delta * start / 2) / rate
    grown, cos, sin = mp.exp(delta * duration / 2), mp.cos(rate * duration), mp.sin(rate * duration)
    after = mean + grown * (start * cos + slope * sin)
    return after, delta / 2 * (after - mean) + rate * grown * (slope * cos - start * sin)


def exact(amplitude, guess):
    """Return the angular frequency and delta of an amplitude, near a guess of both."""
    spring, limit = mp.mpf(STIFFNESS), mp.mpf(LIMIT)
    gives_way = amplitude - 2 * limit / spring

    def missed(delta, sticks, slides):
        place, velocity = moved(amplitude, mp.mpf(0), 1 + spring, spring * amplitude - limit, delta, sticks)
        last, still = moved(gives_way, velocity, mp.mpf(1), limit, delta, slides)
        return place - gives_way, last + amplitude, still

    rate, delta = map(mp.mpf, guess)
    sticks = mp.acos(1 - 2 * limit / spring / amplitude)
    delta, sticks, slides = mp.findroot(missed, (delta, sticks, mp.pi / rate - sticks), tol=1e-60)
    return mp.pi / (sticks + slides), delta


def quantities():
    """Compare delta and frequency of the mode, and the delta at which the branch of its cycles turns back."""
    contact = ss.Contact(
        tangential="x", normal_force=1.0, friction=float(LIMIT), tangential_stiffness=float(STIFFNESS)
    )
    scene = ss.Scene([1.0], [[1.0]], contacts=[contact], dofs=["x"])
    mode = ss.nonlinear_mode(scene, 0, [float(text) for text in REFERENCES])
    found = []
    for text, cycle, delta in zip(REFERENCES, mode.cycles, mode.data.delta.to_numpy(), strict=True):
        expected = exact(mp.mpf(text), REFERENCES[text])
        names = (f"angular frequency at X = {float(text):g} m", f"delta at X = {float(text):g} m")
        computed = (2.0 * np.pi / cycle.period, float(delta))
        for name, unit, true, value, reference in zip(
            names, ("rad/s", "1/s"), expected, computed, REFERENCES[text], strict=True
        ):
            found.append(Quantity(name=name, unit=unit, expected=true, computed=value, reference=reference))
    branch = ss.continuation(
        mode.cycles[0],
        {"delta": (float(mode.data.delta[0]), 0.08)},
        lambda delta: scene.replace(damping=[[-delta]]),
    )
    fold = mp.findroot(
        lambda x: mp.diff(lambda y: exact(y, ("1.06", LARGEST))[1], x), mp.mpf("1.66755"), tol=1e-30
    )
    found.append(
        Quantity(
            name="largest delta, a fold of the branch",
            unit="1/s",
            expected=exact(fold, ("1.06", LARGEST))[1],
            computed=branch.folds[0].value,
            reference=LARGEST,
        )
    )
    return found


CASES = [
    Case(
        title="Nonlinear mode of an oscillator with a Jenkins element",
        source=(
            "Model: tmdsimpy, `tests/test_epmc.py`, without its viscous damping. Concept: M. Krack, "
            "*Nonlinear modal analysis of nonconservative systems*, Computers and Structures 154, 2015. "
            "Closed form: two linear phases."
        ),
        model=(
            "`x'' - delta x' + x + J(x) = 0`, J the force of a spring of 0.25 N/m that slides at 0.2 N. "
            "The nonlinear mode is the branch of limit cycles over delta: its angular frequency, and its "
            "damping ratio `delta / (2 omega)`, over its amplitude. Up to X = 0.8 m the element sticks and "
            "delta = 0; beyond the fold the cycles are unstable."
        ),
        tolerance="Closed form: 1e-12.",
        quantities=quantities,
    )
]
