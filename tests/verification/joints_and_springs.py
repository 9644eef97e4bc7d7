"""Three masses with two Jenkins elements, two cubic springs and an elastic stop: example 07 of NLvib.

The exact periodic motions are from DOP853 with a tolerance of 1e-13, event by event, and Newton's method on
the state after a period, with a residual of 1e-15.
"""

import numpy as np

import stickslip as ss
from verification.case import Case, Quantity, mp

#: Root mean squares of the three displacements by the rate of the force.
RMS = {"1.5": ("0.118977153633", "0.173394563703", "0.610731134974")}
#: Largest multiplier.
MULTIPLIER = "0.8852"


def scene(rate):
    """Return the masses, shaken at the second one."""
    chain = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]])
    joint = {"normal_force": 1.0, "friction": 1.0, "tangential_stiffness": 20.0}
    cubic = ss.spring.Polynomial(0.0, 0.0, 1.0)
    return ss.Scene(
        [1.0, 1.0, 1.0],
        chain,
        0.02 * chain,
        contacts=[ss.Contact(tangential=along, **joint) for along in ({"q1": 1.0}, {"q2": 1.0, "q1": -1.0})],
        dofs=["q1", "q2", "q3"],
        elements=[
            ss.Spring("q2", cubic),
            ss.Spring({"q3": 1.0, "q2": -1.0}, cubic),
            ss.Spring("q3", ss.spring.Gap(1.0, 0.25)),
        ],
        loads=[ss.Harmonic({"q2": 1.0}, rate / (2.0 * np.pi))],
    )


def quantities():
    """Compare mean squares of the three displacements and the largest multiplier."""
    found = []
    for rate, references in RMS.items():
        period = 2.0 * np.pi / float(rate)
        rest = ss.State([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], "ss")
        cycle = ss.simulate(scene(float(rate)), 60.0 * period, rest).limit_cycle(further=300.0 * period)
        times = np.linspace(0.0, cycle.period, 20_001)[:-1]
        places = cycle.run.sample(times).position.to_numpy()
        for name, reference, place in zip(("q1", "q2", "q3"), references, places.T, strict=True):
            found.append(
                Quantity(
                    name=f"root mean square of {name}, W = {rate} rad/s",
                    unit="m",
                    expected=mp.mpf(reference),
                    computed=float(np.sqrt(np.mean(place**2))),
                    reference=reference,
                    relative=5e-12,
                )
            )
        found.append(
            Quantity(
                name=f"largest multiplier, W = {rate} rad/s",
                unit="",
                expected=mp.mpf(MULTIPLIER),
                computed=float(np.abs(cycle.multipliers).max()),
                reference=MULTIPLIER,
                relative=1e-4,
            )
        )
    return found


CASES = [
    Case(
        title="Jenkins elements beside cubic springs and a stop",
        source=(
            "M. Krack, J. Gross, *Harmonic Balance for Nonlinear Vibration Problems*, 2019, NLvib, example "
            "07; exact motions by DOP853, event by event, and Newton's method."
        ),
        model=(
            "Three masses of 1 kg in a chain of four springs of 1 N/m, `C = 0.02 K`, `cos(W t)` N on q2; "
            "Jenkins elements of 20 N/m and 1 N at q1 and at q2 - q1, cubic springs of 1 N/m^3 at q2 and at "
            "q3 - q2, a one-sided spring of 1 N/m at q3 = 0.25 m."
        ),
        tolerance="The twelve digits that are known: 5e-12; the multiplier to four.",
        quantities=quantities,
    )
]
