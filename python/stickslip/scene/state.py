"""Where the system is, how it moves, and what its contacts do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse
from numpy.typing import ArrayLike

from stickslip.faults import InputError
from stickslip.scene.checks import (
    Real,
    default_dofs,
    described,
    dof_names,
    real_array,
    real_number,
    shown_statuses,
)
from stickslip.scene.contact import aligned, dof_index, nearest
from stickslip.scene.scene import Scene, checked
from stickslip.show.summary import Shown, Summary, Table

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

#: Change of a state: dof name or index to amount, or one amount per dof.
Change = Mapping[str | int, float] | ArrayLike
#: What is known of the uniqueness of an equilibrium, in words.
UNIQUE = {True: "the only one", False: "one of several", None: "whether it is the only one: not known"}


@dataclass(frozen=True, eq=False, repr=False)
class State:
    """Position and velocity of every dof, and the status of every contact.

    Parameters
    ----------
    position
        x, (n,), m.
    velocity
        x', (n,), m/s.
    combination
        One letter per contact: ``+`` positive sliding (slip velocity < 0), ``-`` negative sliding,
        ``s`` sticking, ``d`` detached.
    dofs
        Names of the dofs; None: ``x1``, ``x2``, ... A scene takes the entries by these names, and in its own
        order if the names are ``x1``, ``x2``, ... and the scene has others.
    friction_force
        (c,), N: friction forces that the springs of compliant contacts hold where these stick, or slide by a
        law over slip speed, and those of the springs of contacts in planes, along both directions; one entry
        per contact. None: zero where they stick, those of steady sliding where they slide; in a plane, along
        the slip of the state. Those of all other contacts follow from the state, and their entries are
        ignored.
    internal
        (c,), the states z of contacts under a law with a state, 0 of all others; or a mapping from the
        indices of contacts to their states, 0 of those that it leaves out. Of bristles z is the deflection,
        m; of `RateState` ``ln(speed theta / length)``; of `StateLaw` what its formulas call z. None: that of
        steady slip at the slip velocity of the state, and 0 where this vanishes.

    Raises
    ------
    InputError
        If position and velocity are no real, finite vectors of one length, or the combination has another
        letter. Whether the state fits a scene and its own combination is checked by the calls that use it.
    """

    position: Real
    velocity: Real
    combination: str = field(kw_only=True)
    dofs: tuple[str, ...] = field(kw_only=True)
    friction_force: Real | None = field(kw_only=True)
    internal: Real | None = field(kw_only=True)

    def __init__(
        self,
        position: ArrayLike,
        velocity: ArrayLike,
        combination: str,
        dofs: Sequence[str] | None = None,
        friction_force: ArrayLike | None = None,
        internal: ArrayLike | Mapping[int, float] | None = None,
    ) -> None:
        names = default_dofs(np.size(position)) if dofs is None else dof_names(dofs, np.size(position))
        x = real_array("position", aligned("position", position, names), 1)
        v = real_array("velocity", aligned("velocity", velocity, names), 1)
        if x.shape != v.shape:
            raise InputError(f"velocity: expected shape {x.shape} like position, got {v.shape}")
        for argument, values in (("position", x), ("velocity", v)):
            if not np.isfinite(values).all():
                index = int(np.flatnonzero(~np.isfinite(values))[0])
                raise InputError(f"{argument}: must be finite, got {values[index]} at index {index}")
        if not isinstance(combination, str):
            raise InputError(f"combination: expected a string such as '+s', got {described(combination)}")
        if not set(combination) <= set("+-sdo"):
            raise InputError(
                "combination: expected one letter of '+', '-', 's', 'd', 'o' per contact, got "
                f"{combination!r}"
            )
        object.__setattr__(self, "position", x)
        object.__setattr__(self, "velocity", v)
        object.__setattr__(self, "combination", combination)
        object.__setattr__(self, "dofs", names)
        if isinstance(internal, Mapping):
            internal = _by_contact(internal, len(combination))
        for argument, given in (("friction_force", friction_force), ("internal", internal)):
            held = None
            if given is not None and np.size(given):
                held = real_array(argument, given, 1)
                if held.shape != (len(combination),) or not np.isfinite(held).all():
                    expected = f"expected one finite number per contact ({len(combination)})"
                    raise InputError(f"{argument}: {expected}, got {held!r}")
            object.__setattr__(self, argument, held)

    def ordered(self, dofs: tuple[str, ...]) -> State:
        """Return the state with its entries in the order of these dofs.

        Raises
        ------
        InputError
            If the state has names that are not among them.
        """
        if self.dofs == dofs or len(self.dofs) != len(dofs):
            # A state of another size is refused by the calls that use it.
            return self
        if set(self.dofs) != set(dofs):
            if self.dofs == default_dofs(len(dofs)):
                return self
            unknown = next(name for name in self.dofs if name not in dofs)
            raise InputError(f"start: dofs: the scene has no dof {unknown!r}{nearest(unknown, dofs)}")
        order = [self.dofs.index(name) for name in dofs]
        moved = self.position[order], self.velocity[order]
        return State(*moved, self.combination, dofs, self.friction_force, self.internal)

    @property
    def statuses(self) -> str | tuple[str, list[float], list[float]]:
        """The combination with the friction forces and states that go with it, as the core takes it."""
        held = [[] if given is None else given.tolist() for given in (self.friction_force, self.internal)]
        return (self.combination, *held) if any(held) else self.combination

    def perturbed(self, position: Change | None = None, velocity: Change | None = None) -> State:
        """Return the state with amounts added to position and velocity; the combination stays the same.

        Parameters
        ----------
        position, velocity
            Amounts to add, m and m/s: a mapping from dof name or index to amount, or a vector (n,).

        Raises
        ------
        InputError
            If a dof is unknown or an amount is no real number.
        """
        return State(
            self.position + change_vector("position", position, self.dofs),
            self.velocity + change_vector("velocity", velocity, self.dofs),
            self.combination,
            self.dofs,
            self.friction_force,
            self.internal,
        )

    def contact_forces(self, scene: Scene) -> xr.Dataset:
        """Return the forces of the contacts on the structure in this state.

        Parameters
        ----------
        scene
            The scene to which the state belongs.

        Returns
        -------
        xarray.Dataset
            Over ``contact``: ``normal_force`` N >= 0 along n, ``friction_force`` T along t, N. T follows
            from Coulomb's law where the contact slides; it is the force that keeps the contact at rest on its
            slider where it sticks, and 0 where it is open.

        Raises
        ------
        InputError
            If the state does not fit the scene: sizes differ, a contact penetrates its slider, or its
            velocity contradicts the combination.
        """
        import xarray as xr

        state = self.ordered(checked(scene).dofs)
        normal, friction = scene.core.contact_forces(state.position, state.velocity, state.statuses)
        newton = {"units": "N"}
        return xr.Dataset(
            {
                "normal_force": ("contact", np.array(normal), newton),
                "friction_force": ("contact", np.array(friction), newton),
            },
            coords={"contact": scene.contact_labels()},
        )

    def __repr__(self) -> str:
        def row(values: Real) -> str:
            return np.array2string(values, precision=6, threshold=10, edgeitems=3, separator=", ")

        return (
            f"State({self.combination!r}, {self.position.size} dofs,\n"
            f"  position={row(self.position)},\n  velocity={row(self.velocity)})"
        )


def _by_contact(given: Mapping[int, float], count: int) -> list[float]:
    """Return a number per contact from those of some of them.

    Raises
    ------
    InputError
        If a key is no index of a contact.
    """
    for contact in given:
        if not isinstance(contact, int) or not 0 <= contact < count:
            raise InputError(f"internal: expected indices of contacts below {count}, got {contact!r}")
    return [given.get(contact, 0.0) for contact in range(count)]


def change_vector(argument: str, change: Change | None, dofs: tuple[str, ...]) -> Real:
    """Return a change of a state as one amount per dof."""
    added = np.zeros(len(dofs))
    if isinstance(change, Mapping):
        for dof, amount in change.items():
            added[dof_index(argument, dof, dofs)] += real_number(f"{argument}[{dof!r}]", amount)
    elif change is not None:
        vector = real_array(argument, aligned(argument, change, dofs), 1)
        if vector.shape != added.shape:
            raise InputError(f"{argument}: expected shape {added.shape}, got {vector.shape}")
        added += vector
    return added


@dataclass(frozen=True, eq=False, repr=False)
class Equilibrium(State, Shown):
    """Steady sliding: a `State` at rest of a scene, with the contact forces that hold it.

    Attributes
    ----------
    scene
        The scene that slides.
    normal_forces
        N >= 0 of every contact, (c,), N; 0 of open ones.
    unique
        True if it is proved that there is no other equilibrium of steady sliding, False if there is another
        one, None if neither is known.
    other
        The other equilibrium if `unique` is False, otherwise None; its own `unique` is None.
    """

    scene: Scene = field(kw_only=True)
    normal_forces: Real = field(kw_only=True)
    unique: bool | None = field(kw_only=True)
    other: Equilibrium | None = field(kw_only=True)

    def __init__(
        self,
        scene: Scene,
        position: ArrayLike,
        combination: str,
        *,
        normal_forces: ArrayLike,
        unique: bool | None = None,
        other: Equilibrium | None = None,
    ) -> None:
        super().__init__(position, np.zeros(np.shape(position)), combination, scene.dofs)
        object.__setattr__(self, "scene", scene)
        object.__setattr__(self, "normal_forces", real_array("normal_forces", normal_forces, 1))
        object.__setattr__(self, "unique", unique)
        object.__setattr__(self, "other", other)

    @property
    def friction_forces(self) -> Real:
        """T of every contact on the structure along its tangential direction, (c,), N; 0 of open ones."""
        forces: Real = self.contact_forces().friction_force.to_numpy()
        return forces

    def contact_forces(self, scene: Scene | None = None) -> xr.Dataset:
        """Return the contact forces, see `State.contact_forces`; of its own scene if none is given."""
        return super().contact_forces(self.scene if scene is None else scene)

    def to_dataset(self) -> xr.Dataset:
        """Return the state and its forces.

        Returns
        -------
        xarray.Dataset
            Over ``dof`` ``position``, m; over ``contact`` ``normal_force`` and ``friction_force``, N, and
            ``status``, a letter each. The attributes ``combination``, and ``unique``: ``yes``, ``no`` or
            ``not known``.
        """
        known = {True: "yes", False: "no", None: "not known"}[self.unique]
        return (
            self.contact_forces()
            .assign(
                position=("dof", self.position, {"units": "m"}),
                status=("contact", np.array(list(self.combination), dtype=np.str_)),
            )
            .assign_coords(dof=list(self.dofs))
            .assign_attrs(combination=self.combination, unique=known)
        )

    def plot(self, *, ax: Axes | None = None) -> Axes:
        """Draw normal and friction force of every contact as bars; return the Axes.

        Parameters
        ----------
        ax
            Where to draw; None: on axes of its own.
        """
        from stickslip.show.plots import axes_of
        from stickslip.show.style import COLOURS

        axes, places = axes_of(ax), np.arange(len(self.normal_forces))
        axes.bar(places - 0.2, self.normal_forces, 0.4, color=COLOURS["+"], label="normal force")
        axes.bar(places + 0.2, self.friction_forces, 0.4, color=COLOURS["d"], label="friction force")
        axes.axhline(0.0, color="black", linewidth=0.6)
        axes.set(xlabel="contact", ylabel="force, N", title=f"Steady sliding, status {self.combination}")
        if len(places) <= 24:
            axes.set_xticks(places, [str(label) for label in self.scene.contact_labels()])
        axes.legend(frameon=False, fontsize="small")
        return axes

    def summary(self) -> Summary:
        """Return whether the equilibrium is the only one, and a table of the contacts."""
        forces = zip(
            self.scene.contact_labels(),
            self.combination,
            self.normal_forces,
            self.friction_forces,
            strict=True,
        )
        rows = [(str(label), status, float(n), float(t)) for label, status, n, t in forces]
        headings = ("contact", "status", "normal force, N", "friction force, N")
        return Summary([("equilibrium", UNIQUE[self.unique])], [Table("Contacts", headings, rows)])

    def __repr__(self) -> str:
        open_ones = self.combination.count("d")
        closed = f"{len(self.combination) - open_ones} contacts closed, {open_ones} open"
        statuses = shown_statuses(self.combination)
        return f"Equilibrium({statuses!r}, {self.position.size} dofs, {closed}, {UNIQUE[self.unique]})"


def steady_sliding(scene: Scene) -> Equilibrium:
    """Return the equilibrium of steady sliding: the structure at rest, every contact sliding or open.

    The sliding sign of contact i is that of its slider speed: ``+`` for a positive one, T = +mu N. Contacts
    that would pull are open: gaps g >= 0 and normal forces ``N = S g + N_0`` >= 0 with N g = 0 are a linear
    complementarity problem. It has one solution, whatever the load, where the symmetric part of S is positive
    definite, as without friction; with friction there may be none, or several. Up to eight contacts every
    choice of open ones is tried before `Equilibrium.unique` is left open.

    A simulation may begin at the equilibrium as it is. The modes about it are those of its combination;
    `complex_modes` and similar calls ask for that combination by name if some of its contacts are open.

    Returns
    -------
    Equilibrium

    Raises
    ------
    InputError
        If a slider speed is zero (no direction), no equilibrium is found, or the stiffness with all contacts
        closed is singular.
    """
    (position, combination, normal), unique, other = checked(scene).core.sliding_equilibrium()
    if not np.isfinite(position).all():
        sizes = np.abs(scipy.sparse.csr_array(scene.stiffness).data)
        shown = f"{sizes[sizes > 0.0].min(initial=np.inf):.3g} to {sizes.max(initial=0.0):.3g} N/m"
        raise InputError(f"stiffness: its entries, {shown}, leave no finite equilibrium under these forces")
    second = None
    if other is not None:
        second = Equilibrium(scene, *other[:2], normal_forces=other[2])
    return Equilibrium(scene, position, combination, normal_forces=normal, unique=unique, other=second)
