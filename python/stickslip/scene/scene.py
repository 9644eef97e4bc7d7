"""A mechanical model with frictional unilateral contacts."""

from __future__ import annotations

import dataclasses
import inspect
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from stickslip import _core
from stickslip.faults import InputError
from stickslip.scene.checks import (
    Matrix,
    MatrixLike,
    Real,
    core_matrix,
    described,
    dof_names,
    mass_array,
    real_array,
    real_matrix,
)
from stickslip.scene.contact import (
    LAW,
    Contact,
    aligned,
    along_lines,
    contact_labels,
    core_contact,
    described_direction,
    law_number,
    nearest,
)
from stickslip.scene.elements import Element, checked_elements, core_elements, described_elements
from stickslip.scene.laws.damping import (
    DampingLike,
    Rayleigh,
    checked_damping,
    core_damping,
    described_damping,
)
from stickslip.scene.laws.law import FrictionLaw
from stickslip.scene.laws.spring import SpringLaw
from stickslip.scene.loads.in_time import Load
from stickslip.scene.loads.of_scene import checked_loads, core_loads, described_loads
from stickslip.scene.parameters.numbers import Number, changed_parts, found_number
from stickslip.show.mesh import Mesh
from stickslip.show.summary import Shown, Summary, Table

if TYPE_CHECKING:
    from stickslip._core import _ContactData
    from stickslip.scene.drawing.figures import ScenePlots

#: Fields of a scene that are no arguments of it.
HIDDEN = ("core", "model")
#: Contacts that a printed scene lists.
_LISTED = 8
#: Columns of the table of contacts.
HEADINGS = (
    "contact",
    "tangential",
    "normal",
    "friction",
    "static friction",
    "slider speed, m/s",
    "restitution",
    "gap, m",
)
#: Columns that only some scenes have, and the fields that they show.
FURTHER = {
    "normal force, N": "normal_force",
    "normal stiffness, N/m": "normal_stiffness",
    "tangential stiffness, N/m": "tangential_stiffness",
}


@dataclass(frozen=True, init=False, eq=False, repr=False)
class Scene(Shown):
    """``M x'' + (C + G) x' + (K + H) x = F + sum_i (n_i N_i + t_i T_i)``; immutable and validated.

    Parameters
    ----------
    mass
        M: (n,) lumped or (n, n) symmetric positive definite, kg; dense or scipy.sparse, such as the
        consistent mass of finite elements. A sparse mass stays sparse, or becomes (n,) if it is diagonal.
    stiffness
        K: (n, n) symmetric, N/m; dense or scipy.sparse.
    damping
        C: `Rayleigh`, an (n, n) symmetric matrix in N s/m, dense or sparse, or None for no damping. The
        coefficients of `Rayleigh` are not negative; damping that feeds energy is given as a matrix.
    force
        F: (n,), N, constant; None: no force.
    contacts
        The contacts, in the order of the letters of a status combination.
    dofs
        Names of the dofs; None: ``x1``, ``x2``, ...
    impact_friction
        Whether an impact also has a tangential impulse by Coulomb's law, at most friction times the normal
        impulse; otherwise an impact leaves the tangential velocity as it is. Motions need it where mass
        couples normal with tangential directions of contacts.
    gyroscopic
        G: (n, n) skew-symmetric, N s/m, of rotating parts; dense or sparse. None: no such forces.
    circulatory
        H: (n, n), any matrix, N/m, of forces that follow the displacement without a potential: follower
        forces, or friction that another program put into its stiffness. None: no such forces. Its symmetric
        part stores energy as K does. An unsymmetric stiffness A is ``stiffness=(A + A.T) / 2,
        circulatory=(A - A.T) / 2``.
    loads
        Loads in time, `Harmonic` and `Switched`. Steady sliding and modes take only the first values of
        steps.
    elements
        Springs and dampers beside K and C, `Spring` and `Damper`: polynomial, measured, with a gap, or of a
        formula of your own.
    mesh
        Places of the dofs for drawings, as `stickslip.fe.assemble` makes them from its bodies; None: not
        known. No equation uses them, and a scene file does not hold them.

    Raises
    ------
    InputError
        If anything is ill-posed: shape, number, symmetry, mass not positive definite, a contact direction
        unknown or zero, friction < 0, static_friction < friction, restitution outside
        [0, 1], ...
    """

    mass: Matrix
    stiffness: Matrix
    damping: Rayleigh | Matrix | None
    force: Real
    contacts: tuple[Contact, ...]
    dofs: tuple[str, ...]
    impact_friction: bool
    gyroscopic: Matrix | None
    circulatory: Matrix | None
    loads: tuple[Load, ...]
    elements: tuple[Element, ...]
    mesh: Mesh | None
    core: _core.Scene = dataclasses.field(repr=False)
    #: The model function with the arguments that this scene was made of, or None; see `save`.
    model: partial[Scene] | None = dataclasses.field(repr=False)

    def __init__(
        self,
        mass: MatrixLike,
        stiffness: MatrixLike,
        damping: DampingLike | None = None,
        force: ArrayLike | None = None,
        contacts: Sequence[Contact] = (),
        dofs: Sequence[str] | None = None,
        impact_friction: bool = False,
        gyroscopic: MatrixLike | None = None,
        circulatory: MatrixLike | None = None,
        loads: Sequence[Load] = (),
        elements: Sequence[Element] = (),
        mesh: Mesh | None = None,
    ) -> None:
        m = mass_array(mass)
        size = m.shape[0]
        if m.ndim == 2 and m.shape[1] != size:
            raise InputError(f"mass: expected shape (n,) or (n, n), got {m.shape}")
        names = dof_names(dofs, size)
        m = mass_array(aligned("mass", mass, names))
        k = real_matrix("stiffness", aligned("stiffness", stiffness, names))
        c = checked_damping(aligned("damping", damping, names))
        g, h = (
            None if given is None else real_matrix(name, aligned(name, given, names))
            for name, given in (("gyroscopic", gyroscopic), ("circulatory", circulatory))
        )
        f = real_array("force", np.zeros(size) if force is None else aligned("force", force, names), 1)
        if not isinstance(impact_friction, bool | np.bool_):
            raise InputError(f"impact_friction: expected True or False, got {impact_friction!r}")
        if isinstance(contacts, Contact):
            raise InputError("contacts: expected a sequence of contacts, got a single Contact")
        if not np.iterable(contacts):
            raise InputError(f"contacts: expected a sequence of contacts, got {described(contacts)}")
        listed = along_lines(tuple(contacts))
        taken = _core_contacts(listed, names)
        listed_loads = checked_loads(loads, listed)
        listed_elements = checked_elements(elements)
        core = _core.Scene(
            core_matrix(m),
            (core_matrix(k), None if h is None else core_matrix(h)),
            (core_damping(c), None if g is None else core_matrix(g)),
            (f, core_loads(listed_loads, listed, names)),
            (taken, core_elements(listed_elements, names)),
            bool(impact_friction),
        )
        self._set(
            mass=m,
            stiffness=k,
            damping=c,
            force=f,
            contacts=listed,
            dofs=names,
            impact_friction=bool(impact_friction),
            gyroscopic=g,
            circulatory=h,
            loads=listed_loads,
            elements=listed_elements,
            mesh=mesh,
            core=core,
            model=None,
        )

    def _set(self, **fields: Any) -> None:
        for name, value in fields.items():
            object.__setattr__(self, name, value)

    @property
    def size(self) -> int:
        """Number of dofs, n."""
        return len(self.dofs)

    @property
    def unsymmetric(self) -> list[str]:
        """Names of the unsymmetric matrices that the scene has: ``gyroscopic``, ``circulatory``."""
        return [name for name in ("gyroscopic", "circulatory") if getattr(self, name) is not None]

    def replace(self, **changes: Any) -> Scene:
        """Return a scene with some arguments changed.

        Parameters
        ----------
        **changes
            Any argument of `Scene`, or a field of the contact law (``friction``, ``static_friction``,
            ``slider_speed``, ``restitution``, ``gap``, ``normal_force``) as a scalar or with one value per
            contact, or of one contact by index or name (``friction_0``, ``friction_left``), a number of a
            load by its name (``shaker_frequency``, ``load_0_amplitude``), a number of a spring or damper by
            the name of the element (``mount_k3``, ``element_0_offset``), or a coefficient of Rayleigh
            damping (``damping_mass``, 1/s, ``damping_stiffness``, s). A scalar sets all contacts that have
            such a field: friction, for example, those with a tangential direction.

        Raises
        ------
        InputError
            If a name is unknown, two set the same number, the number of values is not the number of contacts,
            or the new scene is ill-posed.
        """
        arguments = self._arguments()
        own = {name: value for name, value in changes.items() if name in arguments}
        parts = SimpleNamespace(**{**arguments, **own})
        numbers: dict[Number, Any] = {}
        if len(own) < len(changes) and "loads" in own:
            parts.loads = checked_loads(parts.loads, parts.contacts)
        for name, value in changes.items():
            number = None if name in own else found_number(parts, name)
            if number is not None:
                numbers[number] = value
            elif name not in own:
                raise InputError(f"replace: unknown field {name!r}{nearest(name, [*arguments, *LAW])}")
        own |= changed_parts(parts, numbers, "replace") if numbers else {}
        if not own.keys() <= {"contacts"}:
            return Scene(**{**arguments, **own})
        contacts = along_lines(tuple(own.get("contacts", self.contacts)))
        laws = {number.field for number in numbers if number.owner == "contact"}
        is_model = "contacts" not in changes and all(one.owner == "contact" for one in numbers)
        # The arrays are shared.
        scene = object.__new__(Scene)
        given = _core_contacts(contacts, self.dofs)
        elements = core_elements(self.elements, self.dofs)
        core = self.core.with_contacts((given, elements), core_loads(self.loads, contacts, self.dofs))
        model = self._model_with(laws, contacts) if is_model else None
        scene._set(**{**arguments, "contacts": contacts, "core": core, "model": model})
        return scene

    def _model_with(self, laws: set[str], contacts: Sequence[Contact]) -> partial[Scene] | None:
        """Return the model with the laws of these contacts, None where it takes no such argument."""
        if self.model is None or not laws <= set(inspect.signature(self.model).parameters):
            return None
        values = {name: [law_number(contact, name) for contact in contacts] for name in laws}
        # What was given as one number for all stays one.
        one = {name: own[0] for name, own in values.items() if all(value == own[0] for value in own)}
        return partial(self.model, **{**values, **one})

    @property
    def plot(self) -> ScenePlots:
        """Pictures: ``scene.plot()`` by its matrices, ``scene.plot.mesh()``, in 3D ``scene.plot.view()``."""
        from stickslip.scene.drawing.figures import ScenePlots

        return ScenePlots(self)

    def contact_labels(self) -> list[int] | list[str]:
        """Return how tables label the contacts: indices, or names as soon as one contact has a name."""
        return contact_labels(self.contacts)

    def tangential_direction(self, contact: int) -> Real:
        """Return the direction t of a contact, (n,); zeros where it has none."""
        return self._direction(contact, 0)

    def normal_direction(self, contact: int) -> Real:
        """Return the direction n of a contact, (n,); zeros where it has none."""
        return self._direction(contact, 1)

    def _direction(self, contact: int, which: int) -> Real:
        core = core_contact(self.contacts[contact], contact, self.dofs)[:2][which]
        if isinstance(core, np.ndarray):
            return core
        direction = np.zeros(self.size)
        if core is None:
            return direction
        for dof, entry in core if isinstance(core, list) else [(core, 1.0)]:
            direction[dof] = entry
        return direction

    def _arguments(self) -> dict[str, Any]:
        """Return what the scene was made of, by the names of its arguments."""
        return {f.name: getattr(self, f.name) for f in dataclasses.fields(self) if f.name not in HIDDEN}

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (tuple(self._arguments().values()), self.model)

    def __repr__(self) -> str:
        planes = sum(one.beside is not None for one in self.contacts) // 2
        directions = f", two for each of {planes} plane{'s' * (planes > 1)}" if planes else ""
        lines = [f"Scene({self.size} dofs, {len(self.contacts)} contacts{directions})"]
        lines.append(f"  dofs: {', '.join(shortened(self.dofs))}")
        lines.append(f"  damping: {described_damping(self.damping)}")
        lines += [f"  {name}: matrix" for name in self.unsymmetric]
        loads = described_loads(self.loads, self.contacts, self.dofs)
        lines += [f"  load {name}: {text}" for name, text in loads]
        lines += [f"  {name}: {text}" for name, text in described_elements(self.elements, self.dofs)]
        labels = self.contact_labels()
        listed = 0
        for k, contact in enumerate(self.contacts[:_LISTED]):
            if contact.beside is not None and contact.beside < k:
                continue  # A plane is listed with its first direction.
            both = (k,) if contact.beside is None else (k, contact.beside)
            listed += len(both)
            law = f"friction {contact.friction:g}"
            if contact.static_friction not in (None, contact.coefficient(0.0)):
                law += f", static {contact.static_friction:g}"
            speeds = ", ".join(f"{self.contacts[one].slider_speed:g}" for one in both)
            law += f", slider speed {speeds if len(both) == 1 else f'({speeds})'} m/s"
            law += f", restitution {contact.restitution:g}" if contact.restitution else ""
            law += f", gap {contact.gap:g} m" if contact.gap else ""
            law += f", normal force {contact.normal_force:g} N" if contact.normal_force else ""
            if (pressed := contact.normal_stiffness) is not None:
                law += f", normal stiffness {pressed:g}" + " N/m" * (not isinstance(pressed, SpringLaw))
            along = ", ".join(described_direction(self.contacts[one].tangential, self.dofs) for one in both)
            place = f"{along} / {described_direction(contact.normal, self.dofs)}"
            names = " and ".join(str(labels[one]) for one in both)
            lines.append(f"  contact{'s' * (len(both) > 1)} {names} ({place}): {law}")
        if (more := len(self.contacts) - listed) > 0:
            lines.append(f"  and {more} more contact{'s' * (more > 1)}: see scene.summary()")
        return "\n".join(lines)

    def summary(self) -> Summary:
        """Return the size of the scene and a table of its contacts."""
        columns = {
            heading: [getattr(one, name) for one in self.contacts] for heading, name in FURTHER.items()
        }
        further = {
            heading: numbers
            for heading, numbers in columns.items()
            if any(number is not None for number in numbers)
        }
        rows = [
            (
                str(label),
                described_direction(contact.tangential, self.dofs),
                described_direction(contact.normal, self.dofs),
                contact.friction if isinstance(contact.friction, FrictionLaw) else float(contact.friction),
                float(contact.holding),
                float(contact.slider_speed),
                float(contact.restitution),
                float(contact.gap),
                *("" if numbers[k] is None else numbers[k] for numbers in further.values()),
            )
            for k, (label, contact) in enumerate(zip(self.contact_labels(), self.contacts, strict=True))
        ]
        masses = self.mass if self.mass.ndim == 1 else self.mass.diagonal()
        low, high = masses.min(), masses.max()
        shown = f"{low:g}" if low == high else f"{low:g} to {high:g}"
        facts = [
            ("dofs", f"{self.size}: {', '.join(shortened(self.dofs))}"),
            ("mass", f"{'lumped' if self.mass.ndim == 1 else 'coupled'}, {shown} kg"),
            ("damping", described_damping(self.damping)),
            *((name, "matrix") for name in self.unsymmetric),
            *((f"load {name}", text) for name, text in described_loads(self.loads, self.contacts, self.dofs)),
            *described_elements(self.elements, self.dofs),
        ]
        return Summary(facts, [Table("Contacts of the scene", (*HEADINGS, *further), rows)])


def checked(scene: Any) -> Scene:
    """Return a scene as it is, and refuse anything else."""
    if isinstance(scene, Scene):
        return scene
    hint = "; call it to have its scene" if callable(scene) else ""
    hint = "; its scene is .scene" if isinstance(getattr(scene, "scene", None), Scene) else hint
    raise InputError(f"scene: expected a Scene, got {described(scene)}{hint}")


def checked_combination(scene: Any, combination: Any) -> str:
    """Return the combination asked for, by default that of steady sliding; the core reads its letters."""
    count = len(checked(scene).contacts)
    if combination is None:
        return checked(scene).core.steady_sliding()
    if isinstance(combination, str):
        return combination
    raise InputError(
        f"combination: expected one letter of '+', '-', 's', 'd', 'o' per contact ({count} in all) as one "
        f"text, got {combination!r}"
    )


def shortened(names: Sequence[str]) -> list[str]:
    """Return names for a line of text: those in the middle are left out where they are many."""
    return list(names) if len(names) <= 12 else [*names[:4], "...", names[-1]]


def _restored(arguments: tuple[Any, ...], model: partial[Scene] | None) -> Scene:
    scene = Scene(*arguments)
    scene._set(model=model)
    return scene


def _core_contacts(contacts: Sequence[Contact], dofs: Sequence[str]) -> list[_ContactData]:
    """Return contacts as the core takes them."""
    taken = [core_contact(contact, i, dofs) for i, contact in enumerate(contacts)]
    for label, uses in Counter(contact_labels(contacts)).items():
        if uses > 1:
            raise InputError(f"contacts: {label!r} names more than one contact")
    return taken
