"""Types of the compiled core. Arrays are C-contiguous float64 unless said otherwise; SI units.

`n` scene dofs, `c` contacts, `m` coordinates left free by a status combination, `k` instants.
Every error a user can cause is raised as a class of `stickslip.errors`.
"""

from collections.abc import Sequence
from typing import Any, Literal, Self, TypedDict, final

import numpy as np
from numpy.typing import NDArray

from stickslip.faults import StickslipError

__all__ = [
    "Batch",
    "Cycle",
    "Family",
    "Orbit",
    "Path",
    "Reduced",
    "Scene",
    "Trajectory",
    "Watch",
    "Works",
    "answers",
    "arithmetic",
    "attractor",
    "chain",
    "closed",
    "energy",
    "settle_all",
    "verdicts",
    "works",
]

_Real = NDArray[np.float64]
_Complex = NDArray[np.complex128]
_Index = NDArray[np.int64]
#: A matrix in compressed rows: data, column indices, row pointers.
_SparseData = tuple[_Real, _Index, _Index]
#: A direction: dof index, (n,) vector, or its (dof index, entry) pairs, ascending.
_Along = int | _Real | list[tuple[int, float]]
#: (normal, tangential) stiffness of a compliant contact, and the law of the normal one in place of a number.
_SpringData = tuple[
    float | None,
    float | None,
    tuple[str, list[float], list[list[float]], list[tuple[str, int, int, float]]] | None,
]
#: Loads in time: (dof entries, frequency, phase), (dof entries, times, values), and of sliders
#: (contact, amplitude, frequency, phase).
_LoadData = tuple[
    list[tuple[list[tuple[int, float]], float, float]],
    list[tuple[list[tuple[int, float]], list[float], list[float]]],
    list[tuple[int, float, float, float]],
]
#: A contact: tangential, normal, friction, static_friction, slider_speed, restitution, gap, normal_force,
#: stiffness, and a law of friction over slip speed: its kind, its numbers, the pieces of a table, the
#: operations of a formula (their names, the slots of their operands, a number).
_ContactData = tuple[
    _Along | None,
    _Along | None,
    float,
    float,
    float,
    float,
    float,
    float,
    _SpringData,
    tuple[str, list[float], list[list[float]], list[tuple[str, int, int, float]]] | None,
    int | None,
]
#: A spring or damper: its kind, its direction by (dof index, entry), its offset, and its law as that of a
#: contact.
_ElementData = tuple[
    str,
    list[tuple[int, float]],
    float,
    tuple[str, list[float], list[list[float]], list[tuple[str, int, int, float]]],
]
#: A combination, with the friction forces that compliant contacts hold and the states of contacts.
_Statuses = str | tuple[str, list[float], list[float]]
#: Lyapunov exponent, 1/s, its standard error, and the time it was measured over, s; nan where there is none.
_Growth = tuple[float, float, float]
#: What a motion settles to: kind, cycle, growth of neighbours, last stretch of the motion.
_Settled = tuple[str, Cycle | None, _Growth, Trajectory | None]

class _ModesData(TypedDict):
    """k modes over m coordinates; matrices of complex numbers are Fortran-contiguous."""

    eigenvalues: _Complex  # (k,)
    right_displacement: _Complex  # (m, k)
    left_displacement: _Complex  # (m, k)
    a: _Complex  # (k,)
    b: _Complex  # (k,)
    shapes: _Complex  # (n, k)
    condition: _Real  # (k,)
    defective: NDArray[np.bool_]  # (k,)
    residual: _Real  # (k,)
    rounding: _Real  # (k,)
    mass: _Real  # (m, m)
    damping: _Real  # (m, m)
    stiffness: _Real  # (m, m)

_Equilibrium = tuple[_Real, str, _Real]

@final
class Scene:
    def __new__(
        cls,
        mass: _Real | _SparseData,  # (n,) or (n, n)
        stiffness: tuple[_Real | _SparseData, _Real | _SparseData | None],  # K and H, (n, n)
        # C as (mass factor, stiffness factor) or (n, n), and G, (n, n)
        damping: tuple[tuple[float, float] | _Real | _SparseData, _Real | _SparseData | None],
        force: tuple[_Real, _LoadData],  # (n,), and in time
        contacts: tuple[Sequence[_ContactData], Sequence[_ElementData]],
        impact_friction: bool,
    ) -> Scene: ...
    def with_contacts(
        self, contacts: tuple[Sequence[_ContactData], Sequence[_ElementData]], loads: _LoadData
    ) -> Scene: ...
    @property
    def size(self) -> int: ...
    @property
    def has_friction_laws(self) -> bool: ...
    @property
    def has_planes(self) -> bool: ...
    @property
    def has_elements(self) -> bool: ...
    # by element: its argument at rest, its force and the first three derivatives of the force
    def elements_at_rest(self, combination: str) -> list[list[float]]: ...
    @property
    def has_massless(self) -> bool: ...  # dofs or nodes of compliant contacts
    def reduced(self, combination: str) -> Reduced: ...
    def modes(self, combination: str) -> _ModesData: ...
    # M_s, C_s, K_s
    def sparse_pencil(self, combination: str) -> list[_SparseData]: ...
    def statics(self, combination: str) -> list[_Real]: ...  # as `Reduced.statics`
    # (k,), and (k, m) by rows; without `b` and matrices
    def judged_pairs(
        self, combination: str, eigenvalues: _Complex, right: _Complex, left: _Complex
    ) -> dict[str, Any]: ...
    def sliding_combination(self) -> str: ...
    def steady_sliding(self) -> str: ...
    # (position, combination, normal forces), whether it is the only one, another one
    def sliding_equilibrium(self) -> tuple[_Equilibrium, bool | None, _Equilibrium | None]: ...
    def check_state(self, position: _Real, velocity: _Real, combination: _Statuses) -> None: ...
    def undetermined(self, combination: str) -> list[int]: ...
    @property
    def dependent(self) -> bool: ...
    def contact_forces(
        self, position: _Real, velocity: _Real, combination: _Statuses
    ) -> tuple[list[float], list[float]]: ...  # normal, friction
    # M, C + G, K + H, and the symmetric and the skew part of K + H, (n, n)
    def matrices(self) -> list[_SparseData]: ...
    # mu and its first three derivatives over the slip speed, in steady sliding
    def friction_derivatives(self, contact: int) -> list[float]: ...
    def state_derivatives(self, contact: int) -> list[list[float]] | None: ...
    def contact_directions(self) -> _Real: ...  # (2c, n)
    def contact_basis(self) -> _Real: ...  # (2c, n)

@final
class Batch:
    def __new__(
        cls,
        duration: float,
        method: Literal["auto", "modal", "taylor", "local"],
        max_events: int | None,
        time_limit: float | None,
        accumulation_tolerance: float,
        on_grazing: Literal["keep", "stop"],
        threads: int | None,
    ) -> Batch: ...
    @property
    def threads(self) -> int: ...
    def submit(
        self,
        scene: Scene,
        start: tuple[_Real, _Real, _Statuses] | None,  # None: sliding equilibrium
        added_position: _Real | None,
        added_velocity: _Real | None,
    ) -> None: ...
    # position, velocity, combination, friction forces at the start and the motion; or why there is none
    def collect(self) -> tuple[_Real, _Real, str, list[float], list[float], Trajectory] | StickslipError: ...
    def stop(self) -> None: ...

@final
class Reduced:
    """`M q'' + C q' + K q = F0 + F1 t`, x = basis q + prescribed motion."""

    mass: _Real  # (m, m)
    damping: _Real  # (m, m)
    stiffness: _Real  # (m, m)
    force_constant: _Real  # (m,) F0 with every sticking contact at zero tangential displacement
    # load (1, m), rows (c, m), offsets (1, c), slider speeds (1, c): margins (normal forces, gaps of open
    # contacts) in
    # equilibrium are rows . K^-1 load - offsets
    statics: list[_Real]
    force_linear: _Real  # (m,) F1
    right_basis: _Real  # (n, m) R
    left_basis: _Real  # (n, m) L

_CriticalKind = Literal["hopf", "divergence", "lock_in", "crossing", "separation"]
_CriticalArrays = tuple[
    list[_CriticalKind], list[int | None], _Complex, _Complex, _Complex, _Real, list[bool]
]
#: (lower, upper, mass, damping, stiffness, statics) on one interval: Chebyshev coefficients (k, m, m);
#: proportional
#: damping as coefficients (k,) of its mass and stiffness factors; of `Reduced.statics` each (k, ., .)
_PieceData = tuple[float, float, _Real, _Real | tuple[_Real, _Real], _Real, Sequence[_Real]]

@final
class Path:
    """A reduced problem along one parameter."""

    def __new__(cls, combination: str, size: int, pieces: Sequence[_PieceData]) -> Path: ...
    @staticmethod
    def contact_law(
        scene: Scene,  # at the lower end
        other: Scene,  # at the upper end
        combination: str,
        contacts: Sequence[int],  # whose friction moves
        lower: float,
        upper: float,
    ) -> Path: ...
    @property
    def size(self) -> int: ...  # m
    @property
    def eigenproblems(self) -> int: ...  # begun along the path by now
    # M, C, K and their derivatives to the parameter, (m, m) each
    def matrices(self, value: float) -> list[_Real]: ...
    # at k ascending values, b branches: eigenvalue, slope, a (complex), condition: (k, b); meetings: (j,);
    # steady_sliding: (k,) bool; normal_force: (k, c); with vectors also right, left: (k, m, b)
    def sweep(self, values: _Real, vectors: bool, modes: int | None = None) -> dict[str, Any]: ...
    # kind, contact (of a separation), parameter, eigenvalue, other eigenvalue, slope of every critical
    # point, and whether steady sliding exists there; number of eigenproblems of the mesh, of starts for
    # lock-ins
    def critical_points(self, imaginary: float) -> tuple[_CriticalArrays, int, int]: ...
    # the same of Hopf points, divergences and separations alone
    def stability_limits(self) -> _CriticalArrays: ...
    # the same of the Hopf points alone, number of eigenproblems, number of modes followed between them
    def hopf_points(self) -> tuple[_CriticalArrays, int, int]: ...
    def growth(self, values: _Real) -> dict[str, Any]: ...

# eigenvalue: least stable, unstable_modes, unstable_eigenvalues: numbers, steady_sliding: (k,);
# normal_force: (k, c)

@final
class Trajectory:
    @staticmethod
    def simulate(
        scene: Scene,
        position: _Real,
        velocity: _Real,
        combination: _Statuses,
        duration: float,
        method: Literal["auto", "modal", "taylor", "local"],
        max_events: int | None,
        time_limit: float | None,
        accumulation_tolerance: float,
        on_grazing: Literal["keep", "stop"],
    ) -> Trajectory: ...
    @staticmethod
    def from_record(scene: Scene, record: bytes) -> Trajectory: ...
    event_count: int
    event_time: _Real
    event_contact: _Index
    event_kind: list[str]
    event_combination: list[str]
    duration: float  # end of the computed motion, s
    stop_reason: str  # duration, max_events, unbounded, chattering, interrupted, failed
    stop_message: str  # the same in words
    counters: dict[str, int]
    accumulations: list[tuple[int, int, float]]  # event index, bounces left out, error bound of the time
    # time, contact, kind of the event not taken, event function at the touch, bound on its error
    grazings: list[tuple[float, int, str, float, float]]
    def state(self, time: float) -> tuple[_Real, _Real, str, list[float], list[float]]: ...
    def event_states(
        self,
    ) -> tuple[_Real, _Real]: ...  # (events, n) position and velocity just after each event
    def sample(self, times: _Real) -> tuple[_Real, _Real, _Real, _Real, NDArray[np.uint8]]: ...
    # position (k, n), velocity (k, n), normal force (k, c), friction force (k, c),
    # status code (k, c) as ASCII of + - s d
    def modal_coordinates(self, times: _Real) -> list[tuple[str, _Index, _Complex]]: ...
    # per maximal run of instants in one combination: combination, indices into times, coordinates (len, 2m)
    def record(self) -> bytes: ...  # what `from_record` takes

@final
class Works:
    """Works over an interval, J; p phases, m impacts, c contacts, g damper groups."""

    kinetic: float
    elastic: float
    states: int
    groups: list[str]
    start: _Real  # (p,) s
    duration: _Real  # (p,) s
    combination: list[str]
    contact: _Real  # (p, c) on the structure
    slider: _Real  # (p, c)
    wear: _Real  # (p, c)
    external: _Real  # (p,)
    circulatory: _Real  # (p,)
    damping: _Real  # (p, g)
    impact_time: _Real  # (m,) s
    impact_contact: _Index  # (m,)
    impact_normal: _Real  # (m,)
    impact_slider: _Real  # (m,)
    impact_friction: _Real  # (m,)

def works(trajectory: Trajectory, t0: float, t1: float) -> Works: ...
def energy(trajectory: Trajectory, times: _Real) -> dict[str, Any]:
    ...
    # kinetic, elastic, rate, external, circulatory (k,), damping (k, g), contact, slider, wear (k, c),
    # combination, groups

@final
class Cycle:
    """`K` phases, `d` dimension of the admissible space at the section."""

    @staticmethod
    def from_record(scene: Scene, record: bytes) -> Cycle: ...
    period: float
    residual: float  # largest mismatch between phases, relative
    load_periods: int  # 0 without loads that oscillate
    combinations: list[str]  # (K,)
    durations: _Real  # (K,)
    multipliers: _Complex  # (d,) descending in modulus
    transverse: _Complex  # (d - 1,) those of the return map
    structural_zeros: int
    dimensions: list[int]  # (K,) of the admissible spaces
    losses: list[int]  # (K,) directions that the event at the end of each phase forgets
    events: list[tuple[int, str]]  # (K,) contact and kind
    series: list[list[int]]  # (K,) contacts that close with the event, where it ends a series over several
    is_corner: bool
    is_stable: bool | None
    stability: str
    largest_multiplier: float
    minimum: _Real  # (n,)
    maximum: _Real  # (n,)
    def trajectory(self) -> Trajectory: ...
    def record(self) -> bytes: ...  # what `from_record` takes
    def monodromy(self) -> _Real: ...  # (2n, 2n), contact coordinates
    def crossing_speeds(self) -> list[float]: ...  # (K,) of the event functions that end the phases
    def harmonics(self, count: int) -> _Complex: ...  # (count + 1, n)
    # phase, contact, kind, lowest value, time, whether it is a local minimum
    def margins(self) -> list[tuple[int, int, str, float, float, bool]]: ...
    def is_followed(self) -> bool: ...
    def orbit(self) -> Orbit: ...
    def continued(self, scene: Scene) -> Cycle: ...

#: State at the section and parameter, in their units.
_Direction = tuple[_Real, float]

@final
class Orbit:
    """`below` and `above` are scenes on either side, `width` units of the parameter apart."""

    shortest: float  # duration of the shortest phase
    # None: towards larger parameters
    def tangent(self, below: Scene, above: Scene, width: float, before: _Direction | None) -> _Direction: ...
    def predicted(
        self, below: Scene, above: Scene, width: float, tangent: _Direction, length: float
    ) -> Orbit: ...
    # orbit, change of the parameter, largest relative change
    def corrected(
        self, scene: Scene, below: Scene, above: Scene, width: float, tangent: _Direction
    ) -> tuple[Orbit, float, float]: ...
    def cycle(self) -> Cycle: ...

#: Follows the motion for at most `limit` s more.
@final
class Watch:
    def __new__(cls) -> Self: ...
    @property
    def followed(self) -> float: ...  # motion that the search has followed so far, s

def attractor(
    trajectory: Trajectory,
    limit: float,
    method: Literal["auto", "modal", "taylor", "local"],
    time_limit: float | None,  # wall-clock seconds of the search, > 0
    watch: Watch,
) -> _Settled: ...
def closed(trajectory: Trajectory, method: Literal["auto", "modal", "taylor", "local"]) -> Cycle | None: ...
def settle_all(
    scenes: Sequence[Scene],
    starts: Sequence[tuple[_Real, _Real, _Statuses]],  # position, velocity, combination
    stretch: float,
    limit: float,
    runs: bool,  # whether the last stretches of the motions come with them
) -> tuple[
    list[tuple[_Settled, str] | None],  # and why the last stretch ended; None: not done
    BaseException | None,  # what interrupted the search
]: ...

#: of a chain of s subsystems, (s,): upper_mass, contact_mass, inclination (rad), vertical_stiffness (upper
#: mass to vertical of the contact mass), horizontal_stiffness, ceiling_stiffness, preload_displacement (m),
#: external_force (N, positive presses down); (s - 1,): link_horizontal, link_vertical
_ChainColumns = dict[str, _Real]

# mass (4s,), stiffness (4s, 4s), force (4s,)
def chain(columns: _ChainColumns, wall_stiffness: float) -> tuple[_Real, _SparseData, _Real]: ...

#: field and place (None: everywhere) of every parameter
_Slots = Sequence[tuple[str, int | None]]

@final
class Family:
    """Scenes as functions of rows of numbers."""

    @staticmethod
    def of_scene(scene: Scene, slots: _Slots, following: Sequence[bool]) -> Family: ...
    @staticmethod
    def of_chain(
        columns: _ChainColumns,
        wall_stiffness: float,
        damping: float,
        contacts: Sequence[_ContactData],
        impact_friction: bool,
        slots: _Slots,
        following: Sequence[bool],  # contacts whose static friction equals their friction
    ) -> Family: ...

# columns by output, one entry or row per sample
def answers(
    samples: tuple[Family, _Real] | Sequence[Scene],  # rows (k, parameters)
    sizes: tuple[int, int, int],  # dofs, contacts, eigenvalues
    combination: str | None,
    growth: bool,
    eigenvalues: bool,
    normal_force: bool,
    hopf: tuple[Sequence[int], float, float] | None,  # contacts, lower, upper
    # duration, further, method, max_events, (position, velocity) added, settle, energy, keep
    motion: tuple[float, float, str, int | None, tuple[_Real, _Real] | None, bool, bool, bool] | None,
    threads: int | None,
) -> dict[str, Any]: ...
def verdicts(
    samples: tuple[Family, _Real] | Sequence[Scene],  # rows (k, parameters)
    contacts: int,
    combination: str | None,
) -> dict[str, Any] | tuple[int, str]: ...  # columns by name, or a sample that has no verdict and why
def arithmetic() -> tuple[str, list[str]]: ...  # target and vector extensions
