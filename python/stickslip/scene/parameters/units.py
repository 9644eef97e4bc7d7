"""The units of parameters, for labelled arrays."""

from __future__ import annotations

from typing import Any

from stickslip.scene.parameters.family import Family

#: Of a contact's law, by whatever model.
LAW_UNITS = {
    "friction": "1",
    "friction_friction": "1",
    "friction_mu0": "1",
    "friction_slope": "s/m",
    "friction_static": "1",
    "friction_kinetic": "1",
    "friction_speed": "m/s",
    "friction_viscous": "s/m",
    "static_friction": "1",
    "slider_speed": "m/s",
    "restitution": "1",
    "gap": "m",
    "normal_force": "N",
    "normal_stiffness": "N/m",
    "tangential_stiffness": "N/m",
}
#: Of loads in time, by the field of the core or its last word; an amplitude is a force or a speed.
LOAD_UNITS = {
    "harmonic_amplitude": "N",
    "steps_amplitude": "N",
    "steps_times": "s",
    "steps_values": "1",
    "vibration_amplitude": "m/s",
    **{
        f"{kind}_{of}": unit
        for kind in ("harmonic", "vibration")
        for of, unit in (("frequency", "Hz"), ("phase", "rad"))
    },
    "frequency": "Hz",
    "phase": "rad",
    "amplitude": "",
    "times": "s",
    "values": "1",
}
#: Of the functions of `stickslip.models`; stiffnesses are told by the end of their names.
MODEL_UNITS = {
    "upper_mass": "kg",
    "contact_mass": "kg",
    "inclination": "rad",
    "preload_displacement": "m",
    "external_force": "N",
    "damping": "s",
}


def parameter_units(model: Any, name: str) -> dict[str, str]:
    """Return ``{"units": ...}`` of a parameter of a scene or of a model function.

    Nothing where it cannot be known: what a function of your own means by its keywords, unless they are those
    of a contact's law.
    """
    family = Family(model)
    entry, _, _, late = family.slot(name)
    if late:
        of_law = (field for field in LAW_UNITS if entry == field or entry.startswith(f"{field}_"))
        stem = entry.rstrip("_0123456789")
        of_load = (field for field in LOAD_UNITS if stem.endswith(f"_{field}"))
        entry = next(of_law, None) or next(of_load)
    if family.is_chain:
        unit = {**MODEL_UNITS, **LAW_UNITS}.get(entry, "N/m" if entry.endswith("_stiffness") else "")
    else:
        unit = {**LAW_UNITS, **LOAD_UNITS}.get(entry, "")
    return {"units": unit} if unit else {}


def derivative_units(of: str, model: Any, name: str) -> dict[str, str]:
    """Return ``{"units": ...}`` of the derivative of a quantity in units `of` to a parameter."""
    unit = parameter_units(model, name).get("units")
    if unit is None:
        return {}
    return {"units": of if unit == "1" else f"{of}/({unit})"}
