"""An elastic bar falls on a rigid floor, contact by contact as its waves run.

The bar of length L falls from the height h under g and arrives at ``sqrt(2 h / g)`` with ``v = sqrt(2 g h)``.
Its lower end stops; a wave of compression runs up with ``c = sqrt(E / rho)``, comes back as one of tension
after ``2 L / c``, and takes the bar off its floor with -v, stress-free: so the bar flies for ``2 v / g`` and
all begins again. For a bar of linear elements with lumped masses, of which the lower end has none (its half
element is carried by its neighbour), the times of contact come nearer with the number of elements.
"""

import numpy as np
import scipy.sparse

import stickslip as ss
from verification.case import Case, Quantity, decimal, mp

LENGTH, MODULUS, DENSITY, GRAVITY, HEIGHT = 10.0, 900.0, 1.0, 10.0, 5.0
ELEMENTS = (50, 200)


def motion(elements):
    """Simulate the bar until its second flight."""
    size = LENGTH / elements
    mass = np.full(elements + 1, DENSITY * size)
    mass[[0, 1, -1]] = 0.0, 1.5 * DENSITY * size, 0.5 * DENSITY * size
    spring = MODULUS / size
    diagonal = np.full(elements + 1, 2.0 * spring)
    diagonal[[0, -1]] = spring
    stiffness = scipy.sparse.diags_array(
        [diagonal, np.full(elements, -spring), np.full(elements, -spring)], offsets=[0, 1, -1]
    ).tocsr()
    scene = ss.Scene(mass, stiffness, force=-mass * GRAVITY, contacts=[ss.Contact(normal=0, gap=HEIGHT)])
    still = np.zeros(elements + 1)
    return ss.simulate(scene, 4.5, ss.State(still, still, "d"))


def quantities():
    """Compare the times of contact with those of the wave solution."""
    length, modulus, density, gravity, height = map(decimal, (LENGTH, MODULUS, DENSITY, GRAVITY, HEIGHT))
    fall, wave = mp.sqrt(2 * height / gravity), 2 * length / mp.sqrt(modulus / density)
    flight = 2 * mp.sqrt(2 * height / gravity)
    exact = [fall, fall + wave, fall + wave + flight, fall + 2 * wave + flight]
    names = ("contact begins", "contact ends", "second contact begins", "second contact ends")
    rows = []
    for elements in ELEMENTS:
        run = motion(elements)
        assert run.events.kind.tolist() == ["closing", "release"] * 2
        # A wave front spreads over some elements: their number grows with the cube root.
        error = 0.3 * elements ** (-2.0 / 3.0)
        rows += [
            Quantity(
                name=f"{name}, {elements} elements",
                unit="s",
                expected=expected,
                computed=computed,
                **({"relative": 0.0, "absolute": error} if place else {}),
            )
            for place, (name, expected, computed) in enumerate(
                zip(names, exact, run.events.time, strict=True)
            )
        ]
        energy = 0.5 * DENSITY * LENGTH * 2.0 * GRAVITY * HEIGHT
        drift = run.balance().residual / energy
        name = f"energy drift, {elements} elements"
        rows.append(Quantity(name=name, unit="", expected=0, computed=drift, absolute=1e-13))
    return rows


CASES = [
    Case(
        title="Bouncing elastic bar",
        source=(
            "D. Doyen, A. Ern, S. Piperno, Time-integration schemes for the finite element dynamic Signorini "
            "problem, SIAM J. Sci. Comput. 33, 2011; wave solution in closed form."
        ),
        model=(
            "A bar of length 10 m, modulus 900 Pa, density 1 kg/m^3 and cross-section 1 m^2 falls from 5 m "
            "under 10 m/s^2. It touches the floor from 1 s to 5/3 s, flies for 2 s and touches it from 11/3 "
            "s to 13/3 s. Linear elements with lumped masses, of which the lower end has none."
        ),
        tolerance=(
            "The fall: 1e-12. Times of contact: `0.3 n^(-2/3)` s with n elements, which is how a front "
            "spreads over them. Energy drift over 4.5 s and two contacts: 1e-13 of the energy of the fall."
        ),
        quantities=quantities,
    )
]
