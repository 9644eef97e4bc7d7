"""Reduced models that fit the contact law: contact coordinates and modes.

The modes are those with held contacts, which keep their inertia (`craig_bampton`), or those of the free
structure, whose contacts have none (`macneal`).
"""

from __future__ import annotations

import dataclasses
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
import xarray as xr
from threadpoolctl import threadpool_limits

from stickslip.faults import InputError
from stickslip.fe.reduced.agreement import Agreement, compared, moves_on
from stickslip.fe.reduced.contact_coordinates import Coordinate, sparse
from stickslip.fe.reduced.craig_bampton import CraigBampton
from stickslip.fe.reduced.macneal import MacNeal
from stickslip.fe.reduced.model import Boundary, Model
from stickslip.modes.complex_modes import complex_modes
from stickslip.modes.modes import Modes
from stickslip.scene.checks import Complex, Real, real_array, real_number, whole_number
from stickslip.scene.contact import entries_of
from stickslip.scene.elements import Element, Spring
from stickslip.scene.laws.damping import Rayleigh
from stickslip.scene.loads.of_scene import load_names
from stickslip.scene.scene import Scene, checked, checked_combination
from stickslip.scene.state import State
from stickslip.scene.structure import directions as element_directions
from stickslip.show.summary import Shown, Summary, Table

#: Fixed-interface modes up to this multiple of the band are there from the start.
ABOVE = 1.5
#: By how much the number of modes grows in one step, what error is left by a step that still pays, and after
#: how many that do not the boundary is what limits the error.
GROWTH, PAYS, PATIENCE = 1.5, 0.8, 2
#: Modes above which a reduced model is none.
MOST = 1000


@dataclass(frozen=True, eq=False, repr=False)
class Reduction(Shown):
    """A reduced model and the way between it and the full one; made by `reduce`.

    Attributes
    ----------
    scene
        The reduced scene: dofs ``t0, n0, t1, ...`` of the contacts, then ``q0, q1, ...`` of the modes,
        with the loads in time of the full one.
    full
        The scene that was reduced.
    boundary
        ``lumped``, ``consistent`` or ``massless``.
    frequencies
        Frequencies of the modes, Hz, (q,): of the structure with held contacts or, with the massless
        boundary, of the free structure. There the last ones, one per contact direction or fewer, stand for
        the inertia of all others; with another boundary the last ones are those of added shapes, if any.
    basis, offset
        ``x = offset + basis y``: (n, m) and (n,), m. The offset is the displacement of the structure with
        held contacts under the constant forces, so that their static effect is exact.
    errors
        xarray.Dataset over ``mode``, the eigenvalues of the full scene in the band: ``full`` and ``reduced``,
        1/s, nan where the reduced scene has none within 5 % (or the tolerance, if that is larger);
        ``frequency_error``, of ``|lambda|`` and relative; ``growth_error``, of ``Re lambda``, relative to its
        size, or to that of the damping ratio 1e-4 where that is larger. Over ``spurious``: ``spurious``, the
        eigenvalues of the reduced scene inside the band that stand for none of the full scene, 1/s. Over
        ``outside``: ``growing_outside``, those outside the band that grow, 1/s. Attributes ``combination``,
        ``boundary``, ``lumping``, and ``missing``, the number of eigenvalues of the full scene that were not
        found (see `Modes`).
    """

    scene: Scene
    full: Scene
    boundary: Boundary
    frequencies: Real
    basis: Real
    offset: Real
    errors: xr.Dataset
    #: p and r of a displacement: (m, n)
    dual: Real

    def project(self, state: State) -> State:
        """Return a state of the full scene as one of the reduced scene.

        The contact coordinates, and with them gaps and slip velocities, stay the same. Of the rest of the
        motion the modes keep the part ``r = Phi' M (x - x0)``.

        Raises
        ------
        InputError
            If the state is not one of the full scene.
        """
        if not isinstance(state, State) or state.position.size != self.full.size:
            raise InputError(f"state: expected a State of {self.full.size} dofs, got {state!r}")
        state = state.ordered(self.full.dofs)
        position = self.dual @ (state.position - self.offset)
        velocity, held = self.dual @ state.velocity, (state.friction_force, state.internal)
        return State(position, velocity, state.combination, self.scene.dofs, *held)

    def expand(self, motion: Any) -> Any:
        """Return displacements of the reduced scene as those of the full one.

        Parameters
        ----------
        motion
            What `Motion.sample` returns, a `State`, the `Modes` of the reduced scene (their shapes), or an
            array (..., m) of displacements.

        Returns
        -------
        xarray.Dataset, State or array
            The same over the n dofs of the full scene; of modes what `Modes.to_dataset` returns.

        Raises
        ------
        InputError
            If it is not of the reduced scene.
        """
        if isinstance(motion, Modes):
            motion = motion.to_dataset()
        if isinstance(motion, State):
            self._fits(motion.position.shape)
            return State(
                self.offset + self.basis @ motion.position,
                self.basis @ motion.velocity,
                motion.combination,
                self.full.dofs,
                motion.friction_force,
                motion.internal,
            )
        if isinstance(motion, xr.Dataset):
            moved = {name: values for name, values in motion.data_vars.items() if "dof" in values.dims}
            if not moved:
                raise InputError("motion: expected a Dataset with displacements over dof")
            whole = motion.drop_vars([*moved, "dof"]).assign_coords(dof=list(self.full.dofs))
            for name, values in moved.items():
                last = values.transpose(..., "dof")
                self._fits(last.shape)
                shown = last.to_numpy() @ self.basis.T + (self.offset if name == "position" else 0.0)
                whole[name] = (last.dims, shown, values.attrs)
            return whole
        array = np.asarray(motion)
        self._fits(array.shape)
        return array @ self.basis.T + self.offset

    def _fits(self, shape: tuple[int, ...]) -> None:
        if not shape or shape[-1] != self.scene.size:
            raise InputError(
                f"motion: expected {self.scene.size} dofs of the reduced scene, got shape {shape}"
            )

    def __repr__(self) -> str:
        return "Reduction\n" + "\n".join(f"  {name}: {value}" for name, value in self.summary().facts)

    def summary(self) -> Summary:
        """Return sizes, how well the eigenvalues of the band agree, and the largest growth."""
        errors = self.errors
        full, reduced, frequency, growth = (
            errors[name].to_numpy() for name in ("full", "reduced", "frequency_error", "growth_error")
        )
        agreement = Agreement(
            full, reduced, frequency, growth, errors.spurious.to_numpy(), errors.growing_outside.to_numpy()
        )
        missing = errors.attrs["missing"]
        counted = "not counted" if missing is None else f"{abs(missing):.2f} missing"
        known = reduced[np.isfinite(frequency)]
        facts = [
            ("full", f"{self.full.size} dofs, {len(self.full.contacts)} contacts"),
            (
                "reduced",
                f"{self.scene.size} dofs, {self.frequencies.size} of them modes "
                f"{'of the free structure' if self.boundary == 'massless' else 'with held contacts'}",
            ),
            ("boundary", f"{self.boundary}{errors.attrs['lumping']}"),
            ("band", f"{full.size} eigenvalues of {errors.attrs['combination']}, {counted}"),
            ("largest errors", f"{frequency.max():.2g} of a frequency, {growth.max():.2g} of a growth rate"),
            ("largest growth", f"{_growth(full)}; reduced {_growth(known) if known.size else 'unknown'}"),
        ]
        if agreement.outside.size:
            count, worst = agreement.outside.size, _growth(agreement.outside)
            grow = "1 mode grows" if count == 1 else f"{count} modes grow"
            facts.append(("outside the band", f"{grow} in the reduced scene, most {worst}"))
        facts += [("warning", remark) for remark in agreement.remarks()]
        rows = [
            (
                str(k),
                abs(one) / (2.0 * np.pi),
                abs(other) / (2.0 * np.pi),
                float(frequency[k]),
                one.real,
                other.real,
                float(growth[k]),
            )
            for k, (one, other) in enumerate(zip(full, reduced, strict=True))
        ]
        headings = (
            "mode", "full, Hz", "reduced, Hz", "error",
            "growth, 1/s", "reduced growth, 1/s", "error of growth",
        )  # fmt: skip
        return Summary(facts, [Table("Eigenvalues of full and reduced scene", headings, rows)])


def reduce(
    scene: Scene,
    band: tuple[float, float],
    boundary: Boundary = "lumped",
    tolerance: float = 1e-3,
    *,
    growth_tolerance: float | None = 0.05,
    combination: str | None = None,
    full_modes: Modes | None = None,
    modes: int | None = None,
    modal_damping: float | None = None,
) -> Reduction:
    """Return a reduced model with the same contacts: contact coordinates and modes.

    Modes are added until the reduced scene has every eigenvalue of the full scene in the band, each with its
    frequency and its growth rate within the tolerances, and no other eigenvalue in the band.

    Parameters
    ----------
    scene
        The full scene; its matrices are sparse.
    band
        Lowest and highest frequency of the eigenvalues that are wanted, Hz.
    boundary
        Model of the inertia S that the modes leave at the contacts. ``lumped``: row sums within the normal
        and within the tangential direction, so that an impact of one contact moves no other. ``consistent``:
        S itself, so that mass couples the contacts. ``massless``: modes of the free structure in place of
        those with held contacts, one further mode per contact direction that stands for the inertia of all
        others (fewer where nearly all modes are kept), and no inertia at the contacts, so that there are no
        impacts; for scenes without a circulatory matrix.
    tolerance
        Largest relative error of a frequency ``|lambda| / 2 pi``.
    growth_tolerance
        Largest relative error of a growth rate ``Re lambda``; of modes with a damping ratio below 1e-4 in
        size, relative to the growth rate of this ratio. None: any.
    combination
        Status combination whose eigenvalues are compared; None: that of the full modes, or of steady sliding.
    full_modes
        The modes of the full scene in the band, where they are known already: what
        ``complex_modes(scene, combination, band=band)`` returns. None: they are computed.
    modes
        Number of modes of the structure; None: as many as the tolerance requires. With a number, the result
        states its errors whatever they are.
    modal_damping
        Damping ratio of the modes of the reduced structure without its contacts, added to the damping that
        the scene has. The errors are those without it.

    Raises
    ------
    InputError
        If the band or a tolerance is ill-posed, the contacts leave no coordinates to reduce, the structure
        can move freely while its contacts are held, a massless boundary does not fit the scene, an inertia at
        a contact is not positive, or the boundary does not allow the tolerances however many modes there are.

    Notes
    -----
    Damping, gyroscopic and circulatory matrices and forces are reduced with the same basis; `Rayleigh`
    damping stays proportional to the reduced matrices. Where frequencies hold and growth rates do not, the
    shapes of the modes concerned, their real and their imaginary part, are added to the basis (unless the
    boundary is massless), since a few modes with held contacts describe them badly. With `modes` a
    warning names every mode that has no counterpart, every spurious eigenvalue, and every mode that grows in
    only one of the two scenes.
    """
    ends = real_array("band", band, 1)
    if ends.shape != (2,) or not 0.0 <= ends[0] < ends[1] < np.inf:
        raise InputError(f"band: expected (lowest, highest) in Hz, got {band!r}")
    if boundary not in ("lumped", "consistent", "massless"):
        raise InputError(f"boundary: expected 'lumped', 'consistent' or 'massless', got {boundary!r}")
    wanted = _tolerance("tolerance", tolerance)
    growth = np.inf if growth_tolerance is None else _tolerance("growth_tolerance", growth_tolerance)
    if not checked(scene).contacts:
        raise InputError("scene: it has no contacts; there is no boundary")
    ratio = None if modal_damping is None else real_number("modal_damping", modal_damping)
    if ratio is not None and not 0.0 <= ratio < 1.0:
        raise InputError(f"modal_damping: expected a ratio from 0 to below 1, got {ratio:g}")
    if full_modes is not None:
        combination = _combination_of(full_modes, scene, combination)
    status = checked_combination(scene, combination)
    # Threads gain little on columns so few, and wait for each other.
    with threadpool_limits(1, user_api="blas"):
        basis: MacNeal | CraigBampton = (
            MacNeal(scene, float(ends[1])) if boundary == "massless" else CraigBampton(scene, boundary)
        )
        if full_modes is None:
            found = complex_modes(scene, status, band=(float(ends[0]), float(ends[1])))
        else:
            found = full_modes[(full_modes.frequencies >= ends[0]) & (full_modes.frequencies <= ends[1])]
        found = found[moves_on(found.eigenvalues)]
        full = found.eigenvalues
        if not full.size:
            raise InputError(f"band: the scene has no eigenvalue from {ends[0]:g} to {ends[1]:g} Hz")
        model, small, agreement = _fitting(basis, found, ends, (wanted, growth), modes)
    for remark in agreement.remarks():
        warnings.warn(f"reduced scene: {remark}", stacklevel=2)
    errors_of = xr.Dataset(
        {
            "full": ("mode", full, {"units": "1/s"}),
            "reduced": ("mode", agreement.reduced, {"units": "1/s"}),
            "frequency_error": ("mode", agreement.frequency, {"units": "1"}),
            "growth_error": ("mode", agreement.growth, {"units": "1"}),
            "spurious": ("spurious", agreement.spurious, {"units": "1/s"}),
            "growing_outside": ("outside", agreement.outside, {"units": "1/s"}),
        },
        attrs={
            "combination": status,
            "boundary": boundary,
            "lumping": model.lumping,
            "missing": found.missing,
        },
    )
    return Reduction(
        small if not ratio else small.replace(damping=_with_modal_damping(model, boundary, ratio)),
        scene,
        boundary,
        np.sqrt(np.maximum(model.squares, 0.0)) / (2.0 * np.pi),
        model.basis,
        model.offset,
        errors_of,
        model.dual,
    )


def _fitting(
    basis: MacNeal | CraigBampton,
    found: Modes,
    ends: Real,
    tolerances: tuple[float, float],
    modes: int | None,
) -> tuple[Model, Scene, Agreement]:
    """Return the first reduced model within the tolerances, or the one with the number of modes given.

    `found` are the modes of the full scene in the band, `tolerances` those of frequency and growth.
    """
    scene, boundary, full = basis.scene, basis.boundary, found.eigenvalues
    wanted, growth = tolerances
    most = min(MOST, scene.size - len(basis.kinds) - 1)
    if most < 1:
        raise InputError(
            f"scene: {len(basis.kinds)} of its {scene.size} coordinates are those of contacts; there is "
            "nothing to reduce"
        )
    if modes is None:
        count = basis.modes.below(ABOVE * ends[1], most)
    elif (count := whole_number("modes", modes, 1)) > most:
        raise InputError(f"modes: expected at most {most}, got {count}")
    best, told, attainable, waited = np.inf, "", "", 0
    added = np.zeros(full.size, dtype=bool)
    while True:
        try:
            if isinstance(basis, CraigBampton) and added.any():
                model = basis.model(count, found.shapes[:, added])
            else:
                model = basis.model(count)
        except InputError as error:
            if not told:
                raise
            raise InputError(f"{told}, and there is no model with {count} modes: {error}") from None
        small = reduced_scene(model, scene, basis.kinds)
        agreement = compared(full, complex_modes(small, found.combination).eigenvalues, ends, wanted)
        excess = agreement.excess(wanted, growth)
        if modes is not None or excess <= 1.0:
            return model, small, agreement
        waited = waited + 1 if excess > PAYS * best else 0
        if excess < best or not told:
            unmet = f"{agreement.unmet(wanted, growth)} is not reached with a {boundary} boundary"
            best, told = excess, f"{unmet}: {count} modes leave {agreement.lacking(wanted, growth)}"
            attainable = agreement.attainable(wanted, growth)
        stuck = waited > PATIENCE or count >= most
        wrong = (agreement.frequency > wanted) | (agreement.growth > growth)
        if boundary != "massless" and (stuck or not (agreement.frequency > wanted).any()):
            more = added | wrong
        else:
            more = added
        if (more > added).any():
            waited = 0
        elif stuck:
            raise InputError(f"{told}, and more modes no less; {_remedy(scene, boundary, attainable)}")
        if (more == added).all():
            count = min(most, max(count + 4, int(GROWTH * count)))
        added = more


def _combination_of(modes: Modes, scene: Scene, combination: str | None) -> str:
    """Return the combination of modes.

    Raise `InputError` if they are not modes of the scene in the combination that is asked for.
    """
    if not isinstance(modes, Modes) or modes.scene is not scene:
        raise InputError("full_modes: expected the modes of the scene that is reduced, of this very object")
    if combination not in (None, modes.combination):
        raise InputError(
            f"full_modes: they are those of {modes.combination!r}, and the combination is {combination!r}"
        )
    return modes.combination


def _remedy(scene: Scene, boundary: Boundary, attainable: str) -> str:
    """Return in words what to do where a boundary does not allow the tolerances, and which one it allows."""
    mass = sparse(scene.mass, scene.size)
    coupled = boundary == "lumped" and mass.count_nonzero() > np.count_nonzero(mass.diagonal())
    lumped = ", or lump the masses of the bodies (`Body.lumped`)" if coupled else ""
    return f"give {attainable}, or another boundary{lumped}"


def _tolerance(name: str, value: float) -> float:
    number = real_number(name, value)
    if not 0.0 < number < 1.0:
        raise InputError(f"{name}: expected a number between 0 and 1, got {number:g}")
    return number


def _growth(values: Complex) -> str:
    worst = max(values, key=np.real)
    return f"{worst.real:.3g} 1/s at {abs(worst) / (2.0 * np.pi):.5g} Hz"


def _with_modal_damping(model: Model, boundary: Boundary, ratio: float) -> Real:
    """Return the damping of a reduced scene and of its real modes with open contacts, ``2 ratio w`` each."""
    if boundary == "massless":
        still = len(model.mass) - model.squares.size
        added = 2.0 * ratio * np.diag(np.sqrt(np.maximum(np.r_[np.zeros(still), model.squares], 0.0)))
    else:
        squares, shapes = scipy.linalg.eigh(model.stiffness, model.mass)
        moved = model.mass @ shapes
        added = (moved * (2.0 * ratio * np.sqrt(np.maximum(squares, 0.0)))) @ moved.T
    damping: Real = model.damping + 0.5 * (added + added.T)
    return damping


def reduced_scene(model: Model, scene: Scene, kinds: tuple[Coordinate, ...]) -> Scene:
    """Return the reduced scene."""
    names = [f"{one.kind[0]}{one.contact}" for one in kinds]
    directions: list[dict[str, Any]] = [{} for _ in scene.contacts]
    for one, name in zip(kinds, names, strict=True):
        directions[one.contact][one.kind] = name
    damping: Any = scene.damping
    if damping is not None and not isinstance(damping, Rayleigh):
        damping = model.damping
    loads = []
    for load_name, load in zip(load_names(scene.loads), scene.loads, strict=True):
        amplitude = np.zeros(scene.size)
        for dof, value in entries_of(load_name, load.amplitude, scene.dofs):
            amplitude[dof] = value
        loads.append(dataclasses.replace(load, amplitude=model.basis.T @ amplitude))
    elements: list[Element] = []
    for element, direction in zip(scene.elements, element_directions(scene).toarray(), strict=True):
        reduced = dataclasses.replace(element, direction=model.basis.T @ direction)
        if isinstance(reduced, Spring):
            reduced = dataclasses.replace(reduced, offset=reduced.offset - float(direction @ model.offset))
        elements.append(reduced)
    diagonal = np.diag(model.mass)
    return Scene(
        diagonal if np.count_nonzero(model.mass) == np.count_nonzero(diagonal) else model.mass,
        model.stiffness,
        damping=damping,
        force=model.force,
        contacts=[
            dataclasses.replace(contact, **of) for contact, of in zip(scene.contacts, directions, strict=True)
        ],
        dofs=[*names, *(f"q{k}" for k in range(model.squares.size))],
        impact_friction=scene.impact_friction,
        gyroscopic=model.gyroscopic,
        circulatory=model.circulatory,
        loads=loads,
        elements=elements,
    )
