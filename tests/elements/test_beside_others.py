"""Springs and dampers beside compliant contacts, dofs without mass, and sliders that vibrate."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from tests.support.contact_spring_peer import ContactSpringPeer

import stickslip as ss


@dataclasses.dataclass(frozen=True)
class WithElements(ContactSpringPeer):
    """The same with a cubic spring along d and a cubic damper on the last dof."""

    direction: object = None
    cubic: float = 0.0
    damper: float = 0.0

    def parts(self, y, status):
        """Return the force on the dofs without friction, and N."""
        force, pressed = super().parts(y, status)
        x, u = np.split(y, 2)
        force = force - self.direction * (self.cubic * float(self.direction @ x) ** 3)
        force[-1] -= self.damper * u[-1] ** 3
        return force, pressed


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("law", [400.0, ss.spring.Polynomial(60.0, 0.0, 9e3)])
def test_motions_beside_a_compliant_contact_are_those_of_dop853(law, seed):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(3, 3))
    mass, stiffness = rng.uniform(0.5, 2.0, 3), 8.0 * root @ root.T + 10.0 * np.eye(3)
    force = np.array([2.0 * rng.normal(), -rng.uniform(2.0, 8.0), 2.0 * rng.normal()])
    direction, cubic, damper = rng.normal(size=3), rng.uniform(50.0, 500.0), 0.2
    friction, speed = rng.uniform(0.2, 0.8), rng.uniform(-0.5, 0.5)
    contact = ss.Contact(tangential=0, normal=1, friction=friction, slider_speed=speed, normal_stiffness=law)
    elements = [
        ss.Spring(direction, ss.spring.Polynomial(0.0, 0.0, cubic)),
        ss.Damper(2, ss.spring.Polynomial(0.0, 0.0, damper)),
    ]
    scene = ss.Scene(mass, stiffness, None, force, [contact], elements=elements)
    x, u = 0.3 * rng.normal(size=3), rng.normal(size=3)
    status = "d" if x[1] > 0.0 else "+" if u[0] < speed else "-"
    run = ss.simulate(scene, 6.0, ss.State(x, u, status))
    pressed = law.force if isinstance(law, ss.spring.Polynomial) else lambda u: law * u
    peer = WithElements(
        *(mass, stiffness, np.zeros((3, 3)), force, np.array([0.0, 1.0, 0.0]), 0.0, pressed),
        *(friction, friction, speed, direction, cubic, damper),
    )
    events, end = peer.run([*x, *u], status, 6.0)
    assert list(run.events.kind) == [kind for _, kind in events]
    assert len(events) > 3
    np.testing.assert_allclose(run.events.time, [time for time, _ in events], atol=1e-9)
    found = run.state(6.0)
    np.testing.assert_allclose([*found.position, *found.velocity], end, atol=1e-8)
    assert abs(run.balance().residual) < 1e-12


def test_a_massless_boundary_follows_beside_a_spring():
    """Springs of 2 and 3 N/m in series past a dof without mass are one of 6/5 N/m."""
    cubic = [ss.Spring("x", ss.spring.Polynomial(0.0, 0.0, 5.0))]
    chain = ss.Scene([1.0, 0.0], [[2.0, -2.0], [-2.0, 5.0]], dofs=["x", "b"], elements=cubic)
    whole = ss.Scene([1.0], [[6.0 / 5.0]], dofs=["x"], elements=cubic)
    starts = [ss.State([0.7, 0.28], [0.1, 0.0], ""), ss.State([0.7], [0.1], "")]
    runs = [ss.simulate(scene, 9.0, start) for scene, start in zip((chain, whole), starts, strict=True)]
    ends = [run.state(9.0) for run in runs]
    assert ends[0].position[0] == pytest.approx(ends[1].position[0], rel=1e-12)
    assert ends[0].position[1] == pytest.approx(0.4 * ends[0].position[0], rel=1e-14)
    assert abs(runs[0].balance().residual) < 1e-13


def test_a_spring_beside_a_slider_that_vibrates_moves_as_by_dop853():
    """A slider so fast that slip never ends, whose vibration changes the friction of Stribeck's law."""
    mass, stiffness = np.array([1.0, 1.5]), np.array([[30.0, -10.0], [-10.0, 20.0]])
    law = ss.friction.Stribeck(static=0.8, kinetic=0.4, speed=2.0)
    speed, amplitude, frequency, pressed, cubic = 3.0, 0.8, 0.7, 5.0, 300.0
    belt = ss.Contact(
        tangential=0,
        normal_force=pressed,
        friction=law,
        slider_speed=speed,
        slider_vibration=ss.Harmonic(amplitude, frequency),
    )
    spring = ss.Spring(1, ss.spring.Polynomial(0.0, 0.0, cubic))
    scene = ss.Scene(mass, stiffness, contacts=[belt], elements=[spring])
    run = ss.simulate(scene, 4.0, ss.State([0.2, 0.1], [0.0, 0.5], "+"))
    assert len(run.events) == 0

    def rates(time, y):
        slip = y[2] - speed - amplitude * np.cos(2.0 * np.pi * frequency * time)
        force = -stiffness @ y[:2] + np.array([law.coefficient(-slip) * pressed, -cubic * y[1] ** 3])
        return np.concatenate([y[2:], force / mass])

    found = solve_ivp(rates, (0.0, 4.0), [0.2, 0.1, 0.0, 0.5], "DOP853", rtol=1e-13, atol=1e-14)
    end = run.state(4.0)
    np.testing.assert_allclose([*end.position, *end.velocity], found.y[:, -1], atol=1e-10)
    assert abs(run.balance().residual) < 1e-12


def test_springs_on_dofs_without_mass_are_refused():
    with pytest.raises(ss.InputError, match="not computed beside dofs without mass on which they act"):
        ss.Scene(
            [1.0, 0.0], np.diag([2.0, 5.0]), elements=[ss.Spring(1, ss.spring.Polynomial(1.0, 0.0, 1.0))]
        )
