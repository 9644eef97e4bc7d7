"""Three masses with two Jenkins elements, two cubic springs and an elastic stop: example 07 of NLvib.

The exact periodic motions are from DOP853 with a tolerance of 1e-13, event by event, and Newton's method on
the state after a period, with a residual of 1e-15.
"""

import numpy as np

import stickslip as ss
from verification.case import Case, Quantity, mp

#: By the rate of the force the root mean squares of the three displacements, and the largest multiplier.
KNOWN = {
    "1.5": (("0.118977153633", "0.173394563703", "0.610731134974"), "0.8852"),
    "1.53": (("0.110657714813", "0.175983463792", "0.644388935803"), "0.8530"),
    "1.56": (("0.110494661659", "0.188697979947", "0.669137478883"), "0.8111"),
    "1.62": (("0.167933070552", "0.230061086616", "0.710434437499"), "0.7780"),
}


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
    # From rest at 1.56 rad/s and above the masses come to a smaller motion, in which joints stay stuck.
    start = ss.State([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], "ss")
    for rate, (references, multiplier) in KNOWN.items():
        period = 2.0 * np.pi / float(rate)
        cycle = ss.simulate(scene(float(rate)), 60.0 * period, start).limit_cycle(further=300.0 * period)
        start = cycle.run.state(0.0)
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
                expected=mp.mpf(multiplier),
                computed=float(np.abs(cycle.multipliers).max()),
                reference=multiplier,
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
            "q3 - q2, a one-sided spring of 1 N/m at q3 = 0.25 m. The first motion starts from rest, each "
            "further one from the cycle before: from rest the masses come to a smaller motion at 1.56 rad/s "
            "and above, in which joints stay stuck, with a multiplier of 1."
        ),
        tolerance="The twelve digits that are known: 5e-12; the multiplier to four.",
        quantities=quantities,
    )
]
