"""Chains of subsystems, each an upper mass on a contact mass that rubs on an inclined slider.

Horizontal of a contact mass is ``cos(inclination) x_t - sin(inclination) x_n``, vertical
``sin(inclination) x_t + cos(inclination) x_n``; vertical is positive upwards. Two subsystems with the default
numbers are the model of Brunetti, Massi, D'Ambrogio and Berthier, "Dynamic and energy analysis of frictional
contact instabilities on a lumped system".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cache
from typing import Any, Literal

import numpy as np
import scipy.sparse

from stickslip import _core
from stickslip.faults import InputError
from stickslip.scene.checks import Real, described, finite, positive, real_number
from stickslip.scene.contact import Contact
from stickslip.scene.laws.damping import Rayleigh
from stickslip.scene.models.naming import defaults, made_by
from stickslip.scene.parameters.numbers import per_contact
from stickslip.scene.scene import Scene

#: A number for all, or one per subsystem or contact.
PerContact = float | Sequence[float] | Real


@dataclass(frozen=True, kw_only=True)
class Subsystem:
    """An upper mass (horizontal, vertical) tied to a contact mass (tangential, normal to its slider).

    Parameters
    ----------
    upper_mass, contact_mass
        kg.
    inclination
        Angle of the slider, rad.
    vertical_stiffness, horizontal_stiffness
        Stiffnesses between upper and contact mass, N/m.
    ceiling_stiffness
        Vertical stiffness between ceiling and upper mass, N/m.
    preload_displacement
        Displacement of the ceiling, m; a positive one presses down. It acts as a force on the upper mass:
        ceiling_stiffness times the displacement.
    external_force
        Force on the upper mass, N; a positive one presses down.
    """

    upper_mass: float
    contact_mass: float
    inclination: float
    vertical_stiffness: float
    horizontal_stiffness: float
    ceiling_stiffness: float
    preload_displacement: float = 0.0
    external_force: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Link:
    """Springs between the upper masses of neighbours, N/m."""

    horizontal_stiffness: float
    vertical_stiffness: float


def chain(
    subsystems: Sequence[Subsystem],
    links: Sequence[Link],
    *,
    wall_stiffness: float,
    friction: PerContact = 0.0,
    slider_speed: PerContact = 0.0,
    static_friction: PerContact | None = None,
    restitution: PerContact = 0.0,
    damping: float = 1e-4,
    impact_friction: bool = False,
) -> Scene:
    """Return the scene of a chain of s subsystems.

    Parameters
    ----------
    subsystems
        The subsystems, beginning at the wall. Subsystem i, from 0 on, has the dofs number 1 + 4i and 2 + 4i
        (horizontal and vertical of the upper mass), 3 + 4i and 4 + 4i (tangential and normal of the contact
        mass), so x5 to x8 for i = 1, and contact i.
    links
        The springs between neighbours, s - 1 of them.
    wall_stiffness
        Horizontal stiffness between the wall and the first upper mass, N/m.
    friction, slider_speed, static_friction, restitution
        Laws of the contacts, see `Contact`; a scalar or one value per contact.
    damping
        beta of ``C = beta K``, s.
    impact_friction
        See `Scene`.

    Raises
    ------
    InputError
        If the numbers of links or values do not match, or a parameter is ill-posed.
    """
    given = dict(locals())
    parts, ties = tuple(subsystems), tuple(links)
    if not parts:
        raise InputError("subsystems: expected at least one, got none")
    if len(ties) != len(parts) - 1:
        raise InputError(f"links: expected {len(parts) - 1} between {len(parts)} subsystems, got {len(ties)}")
    mass, (data, indices, indptr), force = _core.chain(
        chain_columns(parts, ties), real_number("wall_stiffness", wall_stiffness)
    )
    size = mass.size
    count = len(parts)
    laws = zip(
        per_contact("friction", friction, count),
        [None] * count if static_friction is None else per_contact("static_friction", static_friction, count),
        per_contact("slider_speed", slider_speed, count),
        per_contact("restitution", restitution, count),
        strict=True,
    )
    scene = Scene(
        mass,
        scipy.sparse.csr_array((data, indices, indptr), shape=(size, size)),
        damping=Rayleigh(stiffness=real_number("damping", damping)),
        force=force,
        contacts=[
            Contact(
                tangential=4 * i + 2,
                normal=4 * i + 3,
                friction=kinetic,
                static_friction=static,
                slider_speed=speed,
                restitution=bounce,
            )
            for i, (kinetic, static, speed, bounce) in enumerate(laws)
        ],
        impact_friction=impact_friction,
    )
    return made_by(scene, chain, {**given, "subsystems": parts, "links": ties})


#: Stiffnesses of the two-subsystem model, N/m: the labels that its own matrix (Eq. 21) has, and those that
#: Table 1 prints, with which no published frequency comes out.
LABELS: dict[str, dict[str, Any]] = {
    "matrix": {
        "wall_stiffness": 1.8e6,  # k1
        "vertical_stiffness": (4.5e5, 3.0e4),  # k2, k4
        "link_horizontal_stiffness": 1.5e6,  # k3
        "ceiling_stiffness": (6.0e4, 1.8e5),  # k5, k7
        "link_vertical_stiffness": 2.4e5,  # k6
        "horizontal_stiffness": (3.0e5, 2.4e6),  # k8, k9
    },
    "printed": {
        "wall_stiffness": 1.8e6,
        "vertical_stiffness": (4.5e5, 3.0e5),
        "link_horizontal_stiffness": 6.0e4,
        "ceiling_stiffness": (1.5e6, 3.0e4),
        "link_vertical_stiffness": 2.4e5,
        "horizontal_stiffness": (1.8e5, 2.4e6),
    },
}


def two_subsystems(
    *,
    friction: PerContact = 1.5,
    slider_speed: PerContact = 0.025,
    preload_displacement: PerContact = 1e-3,
    external_force: PerContact = 0.0,
    damping: float = 1e-4,
    labels: Literal["matrix", "printed"] = "matrix",
    upper_mass: PerContact = (0.3, 0.7),
    contact_mass: PerContact = (0.3, 0.7),
    inclination: PerContact = (0.3, 0.75),
    wall_stiffness: float | None = None,
    horizontal_stiffness: PerContact | None = None,
    vertical_stiffness: PerContact | None = None,
    ceiling_stiffness: PerContact | None = None,
    link_horizontal_stiffness: float | None = None,
    link_vertical_stiffness: float | None = None,
    static_friction: PerContact | None = None,
    restitution: PerContact = 0.0,
    impact_friction: bool = False,
) -> Scene:
    """Return the published model of two subsystems: the chain of two with the paper's numbers.

    The defaults are the numbers of the standard run.

    Parameters
    ----------
    friction, slider_speed, static_friction, restitution
        Laws of the contacts, see `Contact`; a scalar or one value per contact, as for all other parameters
        except `damping`, `labels`, `impact_friction` and the stiffnesses of wall and link.
    preload_displacement
        Displacements of the ceilings, delta_1 and delta_2, m; a positive one presses down.
    external_force
        Forces on the upper masses, Fex_1 and Fex_2, N; a positive one presses down.
    damping
        beta of ``C = beta K``, s.
    labels
        Which stiffnesses are the defaults: ``matrix`` for those of the paper's matrix, which give the paper's
        results, or ``printed`` for those printed in its Table 1, which do not.
    upper_mass, contact_mass
        m1, m3 and m2, m4, kg.
    inclination
        theta_1, theta_2, rad.
    wall_stiffness
        k1, N/m.
    horizontal_stiffness, vertical_stiffness
        Stiffnesses between upper and contact mass: k8, k9 and k2, k4, N/m.
    ceiling_stiffness
        k5, k7, N/m.
    link_horizontal_stiffness, link_vertical_stiffness
        Stiffnesses between the upper masses: k3 and k6, N/m.
    impact_friction
        See `Scene`.

    Raises
    ------
    InputError
        If a parameter is ill-posed.
    """
    # Nothing but the arguments is local here.
    given = dict(locals())
    return made_by(chain(**chain_arguments(given)), two_subsystems, given)


def chain_arguments(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments of `chain` for some of `two_subsystems`, the others at their defaults."""
    arguments = _standing(given)
    arguments.pop("labels")
    columns = {name: per_contact(name, arguments.pop(name), 2) for name in fields_of(Subsystem)}
    link = {name: arguments.pop(f"link_{name}") for name in fields_of(Link)}
    return {
        "subsystems": [Subsystem(**{name: values[i] for name, values in columns.items()}) for i in range(2)],
        "links": [Link(**link)],
        **arguments,
    }


def standing(given: Mapping[str, Any], name: str) -> Any:
    """Return the value of one argument of `two_subsystems`, given or not."""
    return _standing(given)[name]


def _standing(given: Mapping[str, Any]) -> dict[str, Any]:
    arguments = {name: given.get(name, default) for name, default in defaults(two_subsystems).items()}
    labels = arguments["labels"]
    if labels not in LABELS:
        raise InputError(f"labels: expected 'matrix' or 'printed', got {labels!r}")
    printed = LABELS[labels]
    return {name: printed.get(name) if value is None else value for name, value in arguments.items()}


def chain_columns(subsystems: Sequence[Subsystem], links: Sequence[Link]) -> dict[str, Real]:
    """Return the parts of a chain as the core takes them, one array per field."""
    return {
        **{name: _column("subsystems", subsystems, Subsystem, name) for name in fields_of(Subsystem)},
        "link_horizontal": _column("links", links, Link, "horizontal_stiffness"),
        "link_vertical": _column("links", links, Link, "vertical_stiffness"),
    }


@cache
def fields_of(kind: type[Subsystem] | type[Link]) -> tuple[str, ...]:
    """Return the names of the numbers of a part of a chain."""
    return tuple(field.name for field in fields(kind))


def _column(argument: str, parts: Sequence[Any], kind: type, field: str) -> Real:
    column = np.empty(len(parts))
    for i, part in enumerate(parts):
        if not isinstance(part, kind):
            raise InputError(f"{argument}[{i}]: expected a {kind.__name__}, got {described(part)}")
        checked = positive if field in ("upper_mass", "contact_mass") else finite
        column[i] = checked(f"{argument}[{i}].{field}", getattr(part, field))
        if field == "inclination":
            radians(f"{argument}[{i}].{field}", column[i])
    return column


def radians(argument: str, angle: float) -> None:
    """Refuse an angle beyond a full turn: whoever gives one probably means degrees."""
    if 2.0 * np.pi < abs(angle) < np.inf:
        raise InputError(
            f"{argument}: expected radians, got {angle:g}; {angle:g} degrees are {np.radians(angle):.6g}"
        )
