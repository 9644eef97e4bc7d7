"""Criticality of Hopf points of contacts with a state that can open, by the normal form of the equations."""

import numpy as np
import pytest

import stickslip as ss
from opening_state_scenes import OpeningEquations
from stickslip.locus.criticality import _Sliding

LUGRE = ss.friction.LuGre(static=0.8, kinetic=0.4, speed=0.1, stiffness=400.0, damping=0.02, viscous=0.01)
ROCK = ss.friction.RateState(0.5, 0.02, 0.06, 0.02, 0.1)
#: Entries (x, x', z) of the equations that move while the contact is closed.
FREE = [0, 2, 4]


def pressed(law, speed):
    belt = ss.Contact(tangential="x", normal="y", friction=law, slider_speed=speed)
    return ss.Scene(
        [1.0, 0.7],
        [[90.0, 20.0], [20.0, 200.0]],
        damping=[[0.3, 0.0], [0.0, 0.1]],
        force=[0.0, -5.0],
        contacts=[belt],
        dofs=["x", "y"],
    )


def lyapunov(scene):
    """Return l_1 of an amplitude of 1 (Kuznetsov, 2004, section 5.4), with derivatives by differences."""
    equations, rest = OpeningEquations(scene), ss.steady_sliding(scene)
    y = equations.state(ss.simulate(scene, 1e-9, rest).state(0.0))

    def field(change):
        moved = y.copy()
        moved[FREE] += change
        return equations.rate(0.0, moved, "+")[FREE]

    scale = np.array([1e-2, 1e-1, 0.3 * abs(y[4])])
    units, signs = np.diag(scale), (1.0, -1.0)

    def extrapolated(rule, h):
        return (4.0 * rule(h) - rule(2.0 * h)) / 3.0

    def first(a):
        return extrapolated(lambda h: (field(h * a) - field(-h * a)) / (2.0 * h), 1e-3)

    def second(a, b):
        def rule(h):
            return sum(i * j * field(h * (i * a + j * b)) for i in signs for j in signs) / (4.0 * h**2)

        return extrapolated(rule, 2e-2)

    def third(a, b, c):
        def rule(h):
            terms = ((i, j, k) for i in signs for j in signs for k in signs)
            return sum(i * j * k * field(h * (i * a + j * b + k * c)) for i, j, k in terms) / (8.0 * h**3)

        return extrapolated(rule, 4e-2)

    jacobian = np.array([first(a) for a in units]).T / scale
    twice = np.array([[second(a, b) for b in units] for a in units])
    twice /= np.multiply.outer(scale, scale)[..., None]
    thrice = np.array([[[third(a, b, c) for c in units] for b in units] for a in units])
    thrice /= np.multiply.outer(np.multiply.outer(scale, scale), scale)[..., None]
    values, vectors = np.linalg.eig(jacobian)
    place = int(np.argmax(values.imag))
    rate, p = values[place].imag, vectors[:, place] / abs(vectors[0, place])
    lefts, rows = np.linalg.eig(jacobian.T)
    left = rows[:, int(np.argmin(np.abs(lefts - values[place])))]
    left = left / (left @ p)

    def b(one, other):
        return np.einsum("i,j,ijk->k", one, other, twice)

    mean = np.linalg.solve(-jacobian, b(p, p.conj()))
    double = np.linalg.solve(2j * rate * np.eye(3) - jacobian, b(p, p))
    cubic = np.einsum("i,j,k,ijkl->l", p, p, p.conj(), thrice)
    return rate, (left @ (cubic + 2.0 * b(p, mean) + b(p.conj(), double))).real / (2.0 * rate)


@pytest.mark.parametrize(
    ("law", "low", "high"), [(LUGRE, 0.05, 1.0), (ROCK, 0.01, 2.0)], ids=["LuGre", "rock"]
)
def test_it_is_that_of_the_normal_form(law, low, high):
    points = ss.critical_points(lambda speed: pressed(law, speed), {"speed": (low, high)}, kinds=("hopf",))
    assert len(points) == {LUGRE: 1, ROCK: 2}[law]
    for point in points:
        scene = pressed(law, point.value)
        rate, expected = lyapunov(scene)
        name, found = _Sliding(scene, "+").growth(1j * rate)
        assert found == pytest.approx(expected, rel=1e-3)
        assert point.criticality == name == ("supercritical" if expected < 0.0 else "subcritical")
