"""The parameters of a model as sliders: their values, ranges and units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from stickslip.scene.contact import LAW
from stickslip.scene.laws.law import FrictionLaw
from stickslip.scene.parameters.family import Family
from stickslip.scene.parameters.numbers import FACTORS

#: Ranges of a parameter that stands at zero, by its unit, and of any other.
AT_ZERO = {"1/s": (0.0, 100.0), "m/s": (-0.1, 0.1), "N": (-100.0, 100.0), "m": (0.0, 1e-3), "s": (0.0, 1e-3)}
ANYTHING = (-1.0, 1.0)
#: Multiples of its value between which a parameter moves that must stay positive, such as a stiffness.
POSITIVE = (0.1, 2.5)


@dataclass(frozen=True)
class Knob:
    """One parameter."""

    #: As in `sweep`.
    name: str
    #: The field or keyword that it is a part of: ``friction`` of ``friction_0``.
    entry: str
    #: Present value; None: the parameter follows another one, as static friction does.
    value: float | None
    #: The range of its slider.
    low: float
    high: float
    #: "" where it is not known.
    unit: str


def knobs(family: Family) -> dict[str, Knob]:
    """Return every parameter of a model by its name, those of the contact law that have a value first."""
    numbers = family.numbers()
    entries = {name: family.slot(name).entry for name in numbers}
    at_rest = max((contact.coefficient(0.0) for contact in family.scene({}).contacts), default=0.0)
    found = {}
    order = sorted(entries.items(), key=lambda item: (item[1] not in LAW, numbers[item[0]] is None))
    for name, entry in order:
        value = numbers[name]
        unit = family.units(name).get("units", "")
        low, high = _range(entry, unit, value)
        if value is None and entry.startswith("static_friction"):
            # Static friction is no less than friction at rest.
            low = at_rest
        found[name] = Knob(name, entry, value, low, max(high, 2.0 * low), "" if unit == "1" else unit)
    return found


def joint(family: Family, known: Mapping[str, Knob]) -> dict[str, list[str]]:
    """Return the parameters that one name sets together, such as ``friction`` of all contacts.

    Only those that stand at one value: others have none that they could be moved from together.
    """
    by_entry: dict[str, list[str]] = {}
    for name, knob in known.items():
        stem = name.rpartition("_")[0]
        # The field of a late slot names its contact too.
        by_entry.setdefault(stem if knob.entry == name else knob.entry, []).append(name)
    return {
        entry: names
        for entry, names in by_entry.items()
        # What a function of your own does with one number for an array is not known.
        if len(names) > 1
        and (family.is_chain or entry in LAW)
        and len({known[name].value for name in names}) == 1
    }


def ordinates(family: Family, known: Mapping[str, Knob]) -> list[str]:
    """Return the parameters that are worth the ordinate of the map beside friction, the best one first.

    Steady sliding under constant friction has the same eigenvalues at every slider speed; damping moves them.
    """
    if any(isinstance(contact.friction, FrictionLaw) for contact in family.scene({}).contacts):
        return ["slider_speed", "slider_speed_0"]
    # By the stiffness rather than by the mass, where both are known.
    damping = sorted((name for name in known if name.startswith("damping")), key="damping_mass".__eq__)
    return [*damping, *(name for name, knob in known.items() if knob.entry not in LAW)]


def _range(entry: str, unit: str, value: float | None) -> tuple[float, float]:
    law = entry.startswith(("friction", "static_friction"))
    # A number of a formula may be of any size.
    if law and unit not in ("", "m/s"):
        return min(0.0, 2.0 * (value or 0.0)), max(3.0, 2.0 * (value or 0.0))
    if entry.startswith("restitution"):
        return 0.0, 1.0
    if unit == "rad":
        return min(-0.2, 1.5 * (value or 0.0)), max(1.2, 1.5 * (value or 0.0))
    if not value:
        return AT_ZERO.get(unit, ANYTHING)
    if unit in ("kg", "N/m") or entry in FACTORS:
        return POSITIVE[0] * value, POSITIVE[1] * value
    # A slider at rest has no direction to slide in, and a formula may divide by its numbers.
    low, high = sorted((0.04 * value if unit == "m/s" or law else 0.0, 4.0 * value))
    return low, high
