"""Small scenes, one of every kind, for what has to hold of all of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

import stickslip as ss
from meshed import block

#: Two masses tied by a spring, pressed on a belt by 5 N: x along the belt, y across it.
STIFFNESS = [[90.0, 10.0], [10.0, 200.0]]
DAMPING = ss.Rayleigh(mass=0.1, stiffness=1e-3)


def _scene(*contacts: ss.Contact, **changes: object) -> ss.Scene:
    given = {
        "mass": [1.0, 1.0],
        "stiffness": STIFFNESS,
        "damping": DAMPING,
        "force": [0.0, -5.0],
        "dofs": ["x", "y"],
        "contacts": contacts,
    }
    return ss.Scene(**{**given, **changes})


def _belt(**changes: object) -> ss.Contact:
    given = {"tangential": "x", "normal": "y", "friction": 0.5, "slider_speed": 0.1, "name": "belt"}
    return ss.Contact(**{**given, **changes})


def _levelling(s: Any, kinetic: float = 0.4, rise: float = 0.4, speed: float = 0.1) -> Any:
    """Return friction that falls with slip speed as a law of a user's own says."""
    return kinetic + rise / np.sqrt(1.0 + (s / speed) ** 2)


def _bending(s: Any, z: Any, kinetic: float = 0.4, rise: float = 0.5, stiffness: float = 400.0) -> Any:
    """Return the rate of bristles that a user describes."""
    return s - stiffness * abs(s) * z / (kinetic + rise / np.sqrt(1.0 + (s / 0.1) ** 2))


def _bent(
    s: Any, z: Any, kinetic: float = 0.4, rise: float = 0.5, stiffness: float = 400.0, damping: float = 0.2
) -> Any:
    """Return the friction of these bristles."""
    return stiffness * z + damping * _bending(s, z, kinetic, rise, stiffness)


def _rigid_pad() -> ss.Scene:
    """Return a rigid pad on three points in a row, whose normal directions depend on each other."""
    points = [
        ss.Contact(tangential="x", normal={"y": 1.0, "angle": arm}, friction=0.3, slider_speed=0.1)
        for arm in (-0.05, 0.0, 0.05)
    ]
    return _scene(
        *points,
        mass=[1.0, 1.0, 1e-3],
        stiffness=np.diag([90.0, 200.0, 1.0]),
        force=[0.0, -5.0, 0.02],
        dofs=["x", "y", "angle"],
        impact_friction=True,
    )


def _chain() -> ss.Scene:
    """Return three equal subsystems in a row, which the core holds as blocks."""
    part = ss.models.Subsystem(
        upper_mass=0.3,
        contact_mass=0.3,
        inclination=0.3,
        vertical_stiffness=2e5,
        horizontal_stiffness=1e5,
        ceiling_stiffness=1e5,
        preload_displacement=1e-3,
    )
    link = ss.models.Link(horizontal_stiffness=5e4, vertical_stiffness=5e4)
    return ss.models.chain([part] * 3, [link] * 2, wall_stiffness=2e5, friction=0.8, slider_speed=0.1)


def _meshed() -> ss.Scene:
    body = block(2, 1)
    pairs = ss.fe.contact_pairs(body.surface("low"), None, velocity=(1.0, 0.0), friction=0.5, gap=-1e-6)
    return ss.fe.assemble(body, pairs, impact_friction=True)


def _compliant(**changes: object) -> ss.Scene:
    """Return two undamped dofs on a contact spring."""
    contact = _belt(friction=0.8, slider_speed=1.0, normal_stiffness=30.0)
    given = {"stiffness": [[11.0, -5.0], [-5.0, 10.0]], "force": [0.0, -10.0], "damping": None}
    return _scene(contact, **{**given, **changes})


PLANE = {"tangential": ("x", "y"), "normal": None, "normal_force": 5.0, "slider_speed": (0.1, 0.05)}
STOP = ss.Contact(normal={"x": -1.0}, gap=0.07, restitution=0.5, name="stop")
SPIN = [[0.0, 2.0], [-2.0, 0.0]]

#: Name of a kind to a function that makes a scene of it.
KINDS: dict[str, Callable[[], ss.Scene]] = {
    "lumped belt": lambda: _scene(_belt(static_friction=0.8)),
    "coupled mass": lambda: _scene(
        _belt(restitution=0.3), mass=[[2.0, 0.5], [0.5, 1.0]], impact_friction=True
    ),
    "massless": lambda: _scene(_belt(), mass=[1.0, 0.0]),
    "compliant": _compliant,
    "compliant both ways": lambda: _scene(_belt(normal_stiffness=3000.0, tangential_stiffness=2000.0)),
    "compliant by a law": lambda: _scene(
        _belt(static_friction=0.8, normal_stiffness=ss.spring.Polynomial(200.0, 0.0, 4e4))
    ),
    "compliant by Hertz": lambda: _scene(_belt(static_friction=0.8, normal_stiffness=ss.spring.Hertz(900.0))),
    "springs beside a Jenkins element": lambda: _scene(
        _belt(normal=None, normal_force=5.0, tangential_stiffness=400.0),
        elements=[
            ss.Spring({"x": 1.0, "y": -0.5}, ss.spring.Polynomial(20.0, 0.0, 4e3), name="mount"),
            ss.Spring("y", ss.spring.Gap(stiffness=150.0, clearance=-0.03), name="bump"),
        ],
    ),
    "stop": lambda: _scene(STOP, force=[0.0, 0.0]),
    "stop beside a belt": lambda: _scene(_belt(), STOP),
    "given normal force": lambda: _scene(_belt(normal=None, normal_force=5.0, static_friction=0.7)),
    "plane": lambda: _scene(
        _belt(**PLANE, friction=ss.friction.Stribeck(static=0.6, kinetic=0.4, speed=0.1), static_friction=0.7)
    ),
    "plane with a spring": lambda: _scene(_belt(**PLANE, tangential_stiffness=400.0)),
    "plane that opens": lambda: _scene(
        _belt(tangential=("x", "z"), slider_speed=(0.1, 0.05), static_friction=0.7),
        mass=[1.0, 1.0, 1.0],
        stiffness=[[90.0, 10.0, 5.0], [10.0, 200.0, -20.0], [5.0, -20.0, 60.0]],
        force=[0.0, -5.0, 0.0],
        dofs=["x", "y", "z"],
    ),
    "plane with a spring that opens": lambda: _scene(
        _belt(tangential=("x", "z"), slider_speed=(0.1, 0.05), tangential_stiffness=400.0),
        mass=[1.0, 1.0, 1.0],
        stiffness=[[90.0, 10.0, 5.0], [10.0, 200.0, -20.0], [5.0, -20.0, 60.0]],
        force=[0.0, -5.0, 0.0],
        dofs=["x", "y", "z"],
    ),
    "Stribeck": lambda: _scene(_belt(friction=ss.friction.Stribeck(static=0.8, kinetic=0.4, speed=0.1))),
    "table": lambda: _scene(
        _belt(friction=ss.friction.Tabulated(speeds=[0.0, 0.1, 0.5], values=[0.8, 0.5, 0.45]))
    ),
    "formula": lambda: _scene(_belt(friction=ss.friction.Law(_levelling))),
    "bristles": lambda: _scene(
        _belt(
            friction=ss.friction.LuGre(
                static=0.8, kinetic=0.4, speed=0.1, stiffness=400.0, damping=0.2, viscous=0.01
            ),
            normal=None,
            normal_force=5.0,
        )
    ),
    "bristles that open": lambda: _scene(
        _belt(friction=ss.friction.LuGre(static=0.8, kinetic=0.4, speed=0.1, stiffness=400.0, damping=0.2))
    ),
    "rate and state on a spring": lambda: _scene(
        _belt(
            friction=ss.friction.RateState(
                reference=0.5, direct=0.05, evolution=0.06, length=0.02, speed=0.1
            ),
            normal_stiffness=3000.0,
        )
    ),
    "own state": lambda: _scene(
        _belt(friction=ss.friction.StateLaw(force=_bent, rate=_bending), normal=None, normal_force=5.0)
    ),
    "cubic spring": lambda: _scene(
        _belt(static_friction=0.8),
        elements=[
            ss.Spring({"x": 1.0, "y": -0.5}, ss.spring.Polynomial(20.0, 0.0, 4e3), name="mount"),
            ss.Damper("x", ss.spring.Polynomial(0.1, 0.0, 0.5)),
        ],
    ),
    "elastic stop": lambda: _scene(
        _belt(friction=ss.friction.Stribeck(static=0.8, kinetic=0.4, speed=0.1)),
        elements=[ss.Spring("x", ss.spring.Gap(stiffness=150.0, clearance=0.06), name="bump")],
    ),
    "harmonic load": lambda: _scene(_belt(), loads=[ss.Harmonic({"x": 1.0}, frequency=1.3, name="shaker")]),
    "switched load": lambda: _scene(
        _belt(), loads=[ss.Switched({"x": 0.5}, times=[0.5, 1.0], values=[0.0, 1.0, 0.0])]
    ),
    "vibrating slider": lambda: _scene(_belt(slider_vibration=ss.Harmonic(0.02, frequency=2.0))),
    "gyroscopic": lambda: _scene(_belt(), gyroscopic=SPIN),
    "circulatory": lambda: _scene(_belt(), circulatory=[[0.0, 5.0], [-5.0, 0.0]]),
    "rigid pad": _rigid_pad,
    "two subsystems": lambda: ss.models.two_subsystems(),
    "chain": _chain,
    "mesh": _meshed,
    "undamped": lambda: _scene(_belt(), damping=None),
    "undamped gyroscopic": lambda: _scene(_belt(), damping=None, gyroscopic=SPIN),
    "no contact": lambda: _scene(force=[0.0, 0.0]),
}

#: Velocity of the first dof at the start of a motion, m/s, and its duration, s.
KICKS = {"stop": (0.9, 3.0), "compliant": (-8.0, 6.0)} | {
    "two subsystems": (-0.05, 0.4),
    "chain": (-0.05, 0.3),
    "mesh": (-0.05, 0.01),
}
#: A parameter of a kind and its range, where it is not friction.
PARAMETERS = {
    "Stribeck": ("friction_kinetic", 0.2, 0.6),
    "plane": ("friction_kinetic", 0.2, 0.55),
    "bristles": ("friction_kinetic", 0.2, 0.6),
    "own state": ("friction_kinetic", 0.2, 0.6),
    "bristles that open": ("friction_kinetic", 0.2, 0.6),
    "rate and state on a spring": ("friction_evolution", 0.04, 0.09),
    "table": ("slider_speed", 0.12, 0.3),
    "formula": ("friction_rise", 0.2, 0.6),
    "stop": ("gap", 0.05, 0.1),
    "cubic spring": ("mount_k3", 1e3, 1e4),
    "compliant by a law": ("normal_stiffness_k3", 1e4, 1e5),
    "compliant by Hertz": ("normal_stiffness_stiffness", 900.0, 2000.0),
    "elastic stop": ("friction_kinetic", 0.2, 0.6),
}


@dataclass(frozen=True)
class Kind:
    """A scene of one kind with what is computed of it once."""

    name: str

    @cached_property
    def scene(self) -> ss.Scene:
        """The scene."""
        return KINDS[self.name]()

    @cached_property
    def duration(self) -> float:
        """Duration of the motion, s."""
        return KICKS.get(self.name, (-0.5, 3.0))[1]

    @cached_property
    def parameter(self) -> tuple[str, float, float]:
        """A parameter of the scene and its range: friction, where it is a number."""
        return PARAMETERS.get(self.name, ("friction", 0.2, 0.6))

    @cached_property
    def start(self) -> ss.State:
        """Steady sliding with a kick, so that contacts change their status."""
        kick = KICKS.get(self.name, (-0.5, 3.0))[0]
        return ss.steady_sliding(self.scene).perturbed(velocity={self.scene.dofs[0]: kick})

    @cached_property
    def run(self) -> ss.Trajectory:
        """The motion from there."""
        return ss.simulate(self.scene, self.duration, self.start)

    @cached_property
    def cycle(self) -> ss.Cycle:
        """The limit cycle to which the motion settles, if there is one."""
        return self.run.limit_cycle(further=10.0 * self.duration, time_limit=2.0)

    @cached_property
    def modes(self) -> ss.Modes:
        """The modes of steady sliding."""
        return ss.complex_modes(self.scene)
