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
    return ss.simulate(scene, ss.State(still, still, "d"), 4.5)


def quantities():
    """Compare the times of contact with those of the wave solution."""
    length, modulus, density, gravity, height = map(decimal, (LENGTH, MODULUS, DENSITY, GRAVITY, HEIGHT))
    fall, wave = mp.sqrt(2 * height / gravity), 2 * length / mp.sqrt(modulus / density)
    flight = 2 * mp.sqrt(2 * height / gravity)
    exact = [fall, fall + wave, fall + wave + flight, fall + 2 * wave + flight]
    rows = []
    for elements in ELEMENTS:
        run = motion(elements)
        print(elements, run.events.kind, run.events.time)
    return rows
