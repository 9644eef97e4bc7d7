"""One status combination of a scene along one of its parameters.

The reduced matrices along a parameter are what sweeps, critical points and sensitivities are computed from.
Friction enters them linearly, and the core forms that path exactly. Any other parameter belongs to a model
function, which is sampled at Chebyshev points until the interpolating polynomials leave rounding (Trefethen
2013, chapters 2 to 8); where they don't, the interval is halved.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.fft

from stickslip import _core
from stickslip.errors import InputError
from stickslip.scene.checks import Real, real_array, real_number
from stickslip.scene.contact import LAW, nearest
from stickslip.scene.scene import Proportional, Scene

#: A scene, or a function from named parameters to one.
Model = Scene | Callable[..., Scene]
#: The scene at a value of one parameter.
SceneAt = Callable[[float], Scene]

#: Numbers of Chebyshev points tried on one interval, each twice as fine as the one before.
_POINTS = (3, 5, 9, 17, 33)
#: Where interpolants are compared with the model, in (-1, 1), away from every Chebyshev point.
_CHECKS = (-0.61803398875, 0.2360679775)
#: Largest error of an interpolant, of the largest entry of its row: some rounding errors of forming an entry.
_INTERPOLATED = 64 * np.finfo(float).eps
#: How many of the sampled arrays are `Reduced.statics`.
_STATICS = 4
#: Halvings of the range after which a model counts as not smooth.
_HALVINGS = 12


@dataclass(frozen=True)
class Family:
    """The scenes that a model gives for the values of its parameters.

    Parameters
    ----------
    model
        A `Scene`, whose parameters are the fields of its contacts (``friction`` for all of them,
        ``friction_0`` for contact 0, ``friction_left`` for the contact of that name), or a function from
        keywords to a `Scene`.
    combination
        Status combination; None: that of steady sliding, in which each slider speed gives the sign of its
        contact.
    """

    model: Model
    combination: str | None = None

    def scene(self, **values: float) -> Scene:
        """Return the scene for some parameter values; those not given stay as they are."""
        if isinstance(self.model, Scene):
            scene = self.model
            for name, value in values.items():
                field, contacts = contact_parameter(scene, name)
                law = [getattr(contact, field) for contact in scene.contacts]
                for contact in contacts:
                    law[contact] = value
                scene = scene.replace(**{field: law})
            return scene
        known_parameters(self.model, values)
        scene = self.model(**values)
        if not isinstance(scene, Scene):
            raise InputError(f"model: expected a function that returns a Scene, got {scene!r}")
        return scene

    def letters(self, scene: Scene) -> str:
        """Return the status combination for a scene of the family."""
        return scene.core.sliding_combination() if self.combination is None else self.combination

    def check_direction(self, letters: str, name: str, ends: tuple[float, float], **fixed: float) -> None:
        """Refuse a path on which sliding turns round: no branch leads from one direction to the other.

        Parameters
        ----------
        letters
            The combination at the first of the `ends`.

        Raises
        ------
        InputError
            If that at the second is another one; it names the value between at which it changes.
        """
        if self.combination is not None or self.letters(self.scene(**fixed, **{name: ends[1]})) == letters:
            return
        before, after = ends
        while min(before, after) < (middle := 0.5 * (before + after)) < max(before, after):
            scene = self.scene(**fixed, **{name: middle})
            if any(contact.slider_speed == 0.0 for contact in scene.contacts):
                after = middle
                break
            if self.letters(scene) == letters:
                before = middle
            else:
                after = middle
        other = self.letters(self.scene(**fixed, **{name: ends[1]}))
        # Zero without a sign.
        value = after + 0.0
        raise InputError(
            f"{name}: slider speeds change their sign at {value:.6g}, and steady sliding from {letters!r} to "
            f"{other!r}; take either side by itself, or pass combination"
        )

    def path(self, name: str, lower: float, upper: float, **fixed: float) -> _core.Path:
        """Return the path from `lower` to `upper` of one parameter, the others at `fixed` values.

        Raises
        ------
        InputError
            If a scene on the way is ill-posed, or the model is not a smooth function of the parameter.
        """
        if isinstance(self.model, Scene):
            # Both ends are validated; what lies between them is then valid as well.
            scene = self.scene(**fixed, **{name: lower})
            other = self.scene(**fixed, **{name: upper})
            field, contacts = contact_parameter(scene, name)
            moving = contacts if field == "friction" else []
            letters = self.letters(scene)
            self.check_direction(letters, name, (lower, upper), **fixed)
            return _core.Path.contact_law(scene.core, other.core, letters, moving, lower, upper)
        return _Interpolation(self, name, fixed).path(lower, upper)


def known_parameters(model: Callable[..., Scene], names: Iterable[str]) -> None:
    """Refuse names that a model function does not take.

    Raises
    ------
    InputError
        Naming one, and the nearest that it takes.
    """
    parameters = inspect.signature(model).parameters
    if any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters.values()):
        return
    for name in names:
        if name not in parameters:
            stem, _, label = name.rpartition("_")
            hint = nearest(name, list(parameters))
            if stem in parameters and label.isdecimal():
                hint = f"; give {stem} as a list with one value for each, such as {stem}=[1.0, 2.0]"
                hint += f", or, in a study, the distribution of {name} alone"
            raise InputError(f"{name}: the model has no such parameter{hint}")


def contact_parameter(scene: Scene, name: str) -> tuple[str, list[int]]:
    """Return the field and the contacts that a parameter name of a scene stands for.

    Raises
    ------
    InputError
        If it is no field of the contact law, with or without the label of a contact.
    """
    everything = list(range(len(scene.contacts)))
    if name in LAW:
        return name, everything
    labels = [str(label) for label in scene.contact_labels()]
    known = {f"{field}_{label}": (field, [i]) for field in LAW for i, label in enumerate(labels)}
    if name in known:
        return known[name]
    raise InputError(
        f"{name}: a scene has no such parameter{nearest(name, [*LAW, *known])}; for others pass a function"
        " from parameters to a Scene"
    )


@dataclass
class _Interpolation:
    """Samples of the reduced matrices of a model over one parameter."""

    family: Family
    name: str
    fixed: Mapping[str, float]

    def path(self, lower: float, upper: float) -> _core.Path:
        scene = self.family.scene(**self.fixed, **{self.name: lower})
        self.letters, self.lower = self.family.letters(scene), lower
        self.proportional = isinstance(scene.damping, Proportional) or scene.damping is None
        self.known: dict[float, tuple[Real, ...]] = {}
        self.size = self.sample(lower)[0].shape[0]
        return _core.Path(self.letters, self.size, self.pieces(lower, upper, _HALVINGS))

    def sample(self, value: float) -> tuple[Real, ...]:
        """Return M, C (or alpha and beta), K and statics; matrices (m, m), numbers (1, 1)."""
        if value not in self.known:
            scene = self.family.scene(**self.fixed, **{self.name: value})
            if self.known and self.family.letters(scene) != self.letters:
                self.family.check_direction(self.letters, self.name, (self.lower, value), **self.fixed)
            core = scene.core.reduced(self.letters)
            law = Proportional() if scene.damping is None else scene.damping
            if isinstance(law, Proportional) != self.proportional:
                raise InputError(
                    f"{self.name}: the kind of damping must not change along it, as at {value!r}"
                )
            damping: tuple[Real, ...] = (core.damping,)
            if isinstance(law, Proportional):
                damping = (np.array([[law.mass]]), np.array([[law.stiffness]]))
            sampled = (core.mass, *damping, core.stiffness, *core.statics)
            if self.known and sampled[0].shape != next(iter(self.known.values()))[0].shape:
                raise InputError(f"{self.name}: the number of dofs must not change along it, as at {value!r}")
            self.known[value] = sampled
        return self.known[value]

    def pieces(self, lower: float, upper: float, halvings: int) -> list[Any]:
        centre, half = 0.5 * (lower + upper), 0.5 * (upper - lower)

        def at(t: float) -> tuple[Real, ...]:
            # The ends of adjacent intervals are the same point, exactly.
            return self.sample({-1.0: lower, 1.0: upper}.get(t, centre + half * t))

        checks = [at(t) for t in _CHECKS]
        for points in _POINTS:
            nodes = np.cos(np.pi * np.arange(points) / (points - 1))
            nodes[0], nodes[-1] = 1.0, -1.0
            sampled = [at(float(t)) for t in nodes]
            series = [_coefficients(np.array(values)) for values in zip(*sampled, strict=True)]
            if all(
                # Loads may vanish on the way: their error counts beside their largest value.
                _agrees(coefficients, t, value, whole=len(check) - k <= _STATICS)
                for t, check in zip(_CHECKS, checks, strict=True)
                for k, (coefficients, value) in enumerate(zip(series, check, strict=True))
            ):
                shortened = [_shortened(coefficients) for coefficients in series]
                mass, *damping, stiffness = shortened[:-_STATICS]
                law = tuple(c[:, 0, 0].copy() for c in damping) if self.proportional else damping[0]
                return [(lower, upper, mass, law, stiffness, shortened[-_STATICS:])]
        if halvings == 0:
            raise InputError(
                f"{self.name}: the model is not a smooth function of it near {centre!r}; "
                "sweep the ranges in which it is, one by one"
            )
        return [
            *self.pieces(lower, centre, halvings - 1),
            *self.pieces(centre, upper, halvings - 1),
        ]


def _coefficients(values: Real) -> Real:
    """Return Chebyshev coefficients of values at ``cos(pi j / (k - 1))``, (k, ...)."""
    coefficients: Real = scipy.fft.dct(values, type=1, axis=0) / (len(values) - 1)
    coefficients[[0, -1]] *= 0.5
    return coefficients


def _agrees(coefficients: Real, t: float, value: Real, whole: bool) -> bool:
    interpolated = np.polynomial.chebyshev.chebval(t, coefficients)
    largest = np.abs(coefficients).sum(axis=0).max(initial=0.0)
    scale = np.maximum(
        np.abs(value).max(axis=1, keepdims=True, initial=0.0), largest * (1.0 if whole else 1e-300)
    )
    return bool((np.abs(interpolated - value) <= _INTERPOLATED * scale).all())


def _shortened(coefficients: Real) -> Real:
    """Drop the last coefficients where they are rounding."""
    scale = np.abs(coefficients).sum(axis=0).max(axis=-1, keepdims=True, initial=0.0)
    significant = (np.abs(coefficients) > 8 * np.finfo(float).eps * scale).any(axis=(1, 2))
    last = int(np.flatnonzero(significant).max(initial=0))
    return np.ascontiguousarray(coefficients[: last + 1])


def interval(name: str, value: Any) -> tuple[float, float]:
    """Return a parameter range given as (lower, upper).

    Raises
    ------
    InputError
        If it is not two finite numbers, the first below the second.
    """
    try:
        lower, upper = value
    except (TypeError, ValueError):
        raise InputError(f"{name}: expected a range (lower, upper), got {value!r}") from None
    ends = real_number(name, lower), real_number(name, upper)
    if not (np.isfinite(ends).all() and ends[0] < ends[1]):
        raise InputError(f"{name}: expected finite lower < upper, got {value!r}")
    return ends


def along(model: Model, parameter: dict[str, Any]) -> tuple[str, Real, SceneAt]:
    """Return name and values of the one parameter given as an array, and the scene at a value.

    Raises
    ------
    InputError
        If there is not exactly one array, or a value is not finite.
    """
    arrays = [name for name, value in parameter.items() if np.ndim(value) > 0]
    if len(arrays) != 1:
        raise InputError(f"parameter: expected exactly one with an array of values, got {arrays}")
    name = arrays[0]
    values = real_array(name, parameter[name], 1)
    if values.size == 0 or not np.isfinite(values).all():
        raise InputError(f"{name}: expected finite values, at least one, got {parameter[name]!r}")
    fixed = {key: real_number(key, value) for key, value in parameter.items() if key != name}
    family = Family(model)
    return name, values, lambda value: family.scene(**fixed, **{name: float(value)})


def between(model: Model, parameter: dict[str, Any]) -> tuple[str, float, float, SceneAt]:
    """Return name, begin and end of the one parameter to follow a branch along, and the scene at a value.

    Raises
    ------
    InputError
        If there is not exactly one pair of two finite values.
    """
    name, ends, scene_at = along(model, parameter)
    if ends.size != 2 or ends[0] == ends[1]:
        raise InputError(f"{name}: expected (begin, end) of the branch, got {parameter[name]!r}")
    return name, float(ends[0]), float(ends[1]), scene_at
