"""What a motion settles to over a parameter, and where that changes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import scipy.optimize
import xarray as xr

from stickslip import _core
from stickslip.arrays import Real, real_array, real_number
from stickslip.cycle import Cycle, Settled, described
from stickslip.errors import InputError, OrbitError
from stickslip.modes import complex_modes
from stickslip.path import Family, Model
from stickslip.scene import Scene
from stickslip.state import State, sliding_equilibrium
from stickslip.units import parameter_units

#: Periods of the slowest mode of sliding between two looks at a motion: some tens of periods of a cycle.
STRETCH = 60.0
#: Looks after which a motion counts as one that does not recur.
LOOKS = 30
#: Part of the slider speed at which the most unstable mode starts.
DISTURBANCE = 0.5
#: Halvings of a step along a branch before it counts as ended.
HALVINGS = 10
#: Motions handed to the core at once: an interrupt is heard between two of these.
CHUNK = 64
#: Steps of a search for branch points: between two of them at most one of each kind is expected.
STEPS = 60
#: Accuracy of a multiplier at a branch point: its target is met to this.
MULTIPLIER = 1e-8
#: Relative distance to which the end of a branch is approached by halving; closer, Newton's method needs
#: better
#: starts.
CLOSE = 1e-7
#: Relative difference of period and extremes up to which two cycles are one.
SAME = 1e-6

Kind = Literal["period_doubling", "fold", "torus", "grazing", "switching"]


def disturbed_sliding(scene: Scene) -> State:
    """Return steady sliding with its fastest growing mode set in motion.

    The mode starts with velocity alone; the tangential velocity of no contact exceeds half of its slider
    speed, so that every contact goes on sliding.

    Raises
    ------
    InputError
        If there is no sliding equilibrium.
    """
    start = sliding_equilibrium(scene)
    modes = complex_modes(scene, start.combination)
    shape = modes.shapes[:, int(np.argmax(modes.eigenvalues.real))].real
    slips = [
        abs(float(scene.tangential_direction(i) @ shape)) / abs(contact.slider_speed)
        for i, contact in enumerate(scene.contacts)
    ]
    largest = max(slips, default=0.0)
    return start.perturbed(velocity=shape * (DISTURBANCE / largest if largest > 0.0 else 1e-3))


def bifurcation(
    model: Model,
    *,
    start: State | Callable[[Scene], State] | None = None,
    follow: bool = False,
    stretch: float | None = None,
    limit: float | None = None,
    **parameter: Any,
) -> xr.Dataset:
    """Return what motions settle to over a parameter.

    Every motion is simulated until it recurs, and the recurrence is refined to a periodic orbit by Newton's
    method (`Trajectory.limit_cycle`); values are independent of each other and run on all processors, unless
    `follow`.

    Parameters
    ----------
    model
        A `Scene`, or a function from keywords to one.
    start
        Where every motion starts: a state, or a function from the scene to one; None: `disturbed_sliding`.
    follow
        Start at each value from what the value before has settled to, in the order given: the branch that
        hysteresis stays on. Where no state of it satisfies the new scene, `start` is used, and ``restarted``
        says so.
    stretch
        Motion between two looks, s; None: 60 periods of the slowest mode of sliding at the first value.
    limit
        Motion after which it counts as not recurring, s; None: 30 stretches.
    **parameter
        One array (k,) of values; numbers for any other argument of a model function.

    Returns
    -------
    xarray.Dataset
        Over the parameter: ``kind`` (``cycle``, ``equilibrium``, ``chaotic``, ``quasi-periodic``,
        ``unsettled``, ``unbounded``, ``stopped``); of cycles, else nan or empty: ``period`` s,
        ``main_frequency`` Hz, ``period_doubled``, ``stable``, ``sequence`` of combinations,
        ``largest_multiplier`` (modulus, without the one that is 1), ``multiplier`` (parameter, order)
        complex, ``amplitude``, ``minimum``, ``maximum`` (parameter, dof) m; of others ``exponent``, the
        largest Lyapunov exponent across the flow, 1/s; ``restarted``. The attribute ``cycles`` holds the
        `Cycle` of every value, or None.

    Raises
    ------
    InputError
        If the parameter is unknown, there is not exactly one array, a value is not finite, or a scene or
        start is ill-posed.
    """
    name, values, scene_at = _along(model, parameter)
    scenes = [scene_at(value) for value in values]
    starts = _starts(start)
    length = _stretch(scenes[0], stretch)
    end = LOOKS * length if limit is None else _positive("limit", limit)
    if follow:
        found, restarted = _followed(scenes, starts, length, end)
    else:
        found = _settled(scenes, [starts(scene) for scene in scenes], length, end)
        restarted = np.zeros(values.size, dtype=bool)
    cycles = [
        None if core is None else Cycle(scene, core)
        for scene, ((_, core, _, _), _) in zip(scenes, found, strict=True)
    ]
    kinds, exponents = [], []
    for (kind, _, growth, _), message in found:
        kinds.append(kind if kind == "cycle" else described(kind, growth, message)[0])
        exponents.append(growth[0])
    result = _table(model, name, values, cycles)
    result["kind"] = (name, kinds)
    result["exponent"] = (name, np.array(exponents), {"units": "1/s"})
    result["restarted"] = (name, restarted)
    return result


def _table(model: Model, name: str, values: Real, cycles: Sequence[Cycle | None]) -> xr.Dataset:
    """Return cycles over a parameter as one dataset; nan, False or empty where there is none."""
    scene = next((cycle.scene for cycle in cycles if cycle is not None), None)
    dofs = [] if scene is None else list(scene.dofs)
    width = max((cycle.multipliers.size for cycle in cycles if cycle is not None), default=0)

    def column(of: Callable[[Cycle], Any], missing: Any) -> Any:
        return np.array([missing if cycle is None else of(cycle) for cycle in cycles])

    def padded(cycle: Cycle) -> Any:
        row = np.full(width, complex(np.nan, np.nan))
        row[: cycle.multipliers.size] = cycle.multipliers
        return row

    def largest(cycle: Cycle) -> float:
        return float(np.abs(cycle.transverse_multipliers).max(initial=0.0))

    nothing = np.full(len(dofs), np.nan)
    rows: dict[str, Any] = {
        "period": (name, column(lambda c: c.period, np.nan), {"units": "s"}),
        "main_frequency": (name, column(lambda c: c.main_frequency(), np.nan), {"units": "Hz"}),
        "period_doubled": (name, column(lambda c: c.period_doubled, False)),
        "stable": (name, column(lambda c: c.stable, False)),
        "sequence": (name, column(lambda c: " ".join(c.combinations), "")),
        "largest_multiplier": (name, column(largest, np.nan), {"units": "1"}),
        "multiplier": (
            (name, "order"),
            column(padded, np.full(width, complex(np.nan, np.nan))),
            {"units": "1"},
        ),
    }
    lowest = column(lambda c: c.core.minimum, nothing)
    highest = column(lambda c: c.core.maximum, nothing)
    for key, cells in (("minimum", lowest), ("maximum", highest), ("amplitude", 0.5 * (highest - lowest))):
        rows[key] = ((name, "dof"), cells, {"units": "m"})
    coords = {name: (name, values, parameter_units(model, name)), "dof": dofs}
    return xr.Dataset(rows, coords=coords, attrs={"cycles": tuple(cycles)})


def follow_branch(cycle: Cycle, model: Model | None = None, **parameter: Any) -> xr.Dataset:
    """Return the branch of periodic orbits through a cycle, stable or not.

    The sequence of events stays that of the cycle; Newton's method solves its equations at each value from
    the orbit at the value before, in steps halved where it fails.

    Parameters
    ----------
    cycle
        Where to begin; the first value should be near its own.
    model
        A function from keywords to a `Scene`; None: the scene of the cycle.
    **parameter
        One array (k,) of values, in the order of the branch.

    Returns
    -------
    xarray.Dataset
        As `bifurcation` for its cycles, and ``followed``: whether the contact laws of the scene hold all
        along the orbit. nan beyond a fold, where the branch turns back.

    Raises
    ------
    InputError
        If the parameter is unknown or there is not exactly one array.
    """
    name, values, scene_at = _along(cycle.scene if model is None else model, parameter)
    orbits: list[Cycle | None] = []
    before: tuple[float, Cycle] = (float(values[0]), cycle)
    for value in values:
        try:
            orbit = _continued(before, float(value), scene_at)
        except OrbitError:
            break
        orbits.append(orbit)
        before = (float(value), orbit)
    orbits += [None] * (values.size - len(orbits))
    result = _table(cycle.scene if model is None else model, name, values, orbits)
    result["followed"] = (name, [orbit is not None and orbit.is_followed() for orbit in orbits])
    return result


@dataclass(frozen=True, repr=False)
class BranchPoint:
    """A value of a parameter at which a periodic orbit changes.

    Attributes
    ----------
    parameter, value
        Name and value of the parameter.
    kind
        ``period_doubling`` (a multiplier at -1), ``fold`` (another one at 1), ``torus`` (a pair on the unit
        circle), ``grazing`` (an event function touches zero within a phase), ``switching`` (two events meet).
    multiplier
        The critical multiplier; nan for a change of the sequence.
    contact, event
        What happens beyond, where the sequence changes; None otherwise.
    cycle
        The orbit at the point; where the branch ends there, the last one before it.
    """

    parameter: str
    value: float
    kind: Kind
    multiplier: complex
    contact: int | None
    event: str | None
    cycle: Cycle

    def __repr__(self) -> str:
        place = f"{self.kind} at {self.parameter} = {self.value:.12g}"
        if self.contact is None:
            return f"BranchPoint({place}, multiplier {self.multiplier:.6g}, {self.cycle.frequency:.6g} Hz)"
        return f"BranchPoint({place}, contact {self.contact}: {self.event}, {self.cycle.frequency:.6g} Hz)"


def branch_points(
    cycle: Cycle, model: Model | None = None, *, steps: int = STEPS, **parameter: Any
) -> tuple[BranchPoint, ...]:
    """Return where the branch of orbits through a cycle changes stability, folds or leaves its sequence.

    Parameters
    ----------
    cycle
        Where to begin.
    model
        A function from keywords to a `Scene`; None: the scene of the cycle.
    steps
        Steps of the search, >= 1: two points of one kind within a step cancel.
    **parameter
        (begin, end): the branch is followed from the first to the second value, up to a change of the
        sequence.

    Returns
    -------
    tuple of BranchPoint
        In the order of the branch. The critical multiplier of a period doubling meets -1 to 1e-8.

    Raises
    ------
    InputError
        If the parameter is unknown or not a pair of two values.
    OrbitError
        If Newton's method does not find the orbit at the first value.
    """
    if isinstance(steps, bool) or not isinstance(steps, int) or steps < 1:
        raise InputError(f"steps: expected an integer >= 1, got {steps!r}")
    name, ends, scene_at = _along(cycle.scene if model is None else model, parameter)
    if ends.size != 2 or ends[0] == ends[1]:
        raise InputError(f"{name}: expected (begin, end) of the branch, got {parameter[name]!r}")
    values = np.linspace(ends[0], ends[1], steps + 1)
    points: list[BranchPoint] = []
    before = (float(values[0]), cycle.continued(scene_at(float(values[0]))))
    for value in values[1:]:
        try:
            after = (float(value), _continued(before, float(value), scene_at))
        except OrbitError:
            points.extend(_branch_end(name, before, float(value), scene_at))
            break
        found = [
            *_crossings(name, before, after, scene_at),
            *_sequence_changes(name, before, after, scene_at),
        ]
        found.sort(key=lambda point: abs(point.value - before[0]))
        for point in found:
            points.append(point)
            if point.kind in ("grazing", "switching"):
                return tuple(points)
        before = after
    return tuple(points)


Placed = tuple[float, Cycle]
SceneAt = Callable[[float], Scene]


def _continued(before: Placed, value: float, scene_at: SceneAt, halvings: int = HALVINGS) -> Cycle:
    try:
        return before[1].continued(scene_at(value))
    except OrbitError:
        if halvings == 0 or value == before[0]:
            raise
    middle = 0.5 * (before[0] + value)
    half = _continued(before, middle, scene_at, halvings - 1)
    return _continued((middle, half), value, scene_at, halvings - 1)


def _product(cycle: Cycle, target: float) -> float:
    # Real, because multipliers come in conjugate pairs; zero where one of them is at the target.
    return float(np.prod(cycle.transverse_multipliers - target).real)


def _pairs_outside(cycle: Cycle) -> float:
    """Modulus of the outermost complex pair less 1; -1 without one."""
    pairs = cycle.transverse_multipliers[np.abs(cycle.transverse_multipliers.imag) > 0.0]
    return float(np.abs(pairs).max(initial=0.0)) - 1.0


def _crossings(name: str, before: Placed, after: Placed, scene_at: SceneAt) -> Iterable[BranchPoint]:
    tests: tuple[tuple[Kind, Callable[[Cycle], float], complex], ...] = (
        ("period_doubling", lambda cycle: _product(cycle, -1.0), -1.0),
        ("fold", lambda cycle: _product(cycle, 1.0), 1.0),
        ("torus", _pairs_outside, np.nan),
    )
    for kind, test, target in tests:
        if np.sign(test(before[1])) == np.sign(test(after[1])):
            continue
        value, cycle = _root(test, before, after, scene_at)
        multipliers = cycle.transverse_multipliers
        if kind == "torus":
            critical = complex(multipliers[int(np.argmin(np.abs(np.abs(multipliers) - 1.0)))])
            missed = abs(abs(critical) - 1.0)
        else:
            critical = complex(multipliers[int(np.argmin(np.abs(multipliers - target)))])
            missed = abs(critical - target)
        # A pair that becomes real passes no root of the modulus of pairs.
        if missed <= MULTIPLIER:
            yield BranchPoint(name, value, kind, critical, None, None, cycle)


def _root(test: Callable[[Cycle], float], before: Placed, after: Placed, scene_at: SceneAt) -> Placed:
    known = {before[0]: before[1], after[0]: after[1]}

    def orbit(value: float) -> Cycle:
        if value not in known:
            nearest = min(known, key=lambda other: abs(other - value))
            known[value] = _continued((nearest, known[nearest]), value, scene_at)
        return known[value]

    low, high = sorted((before[0], after[0]))
    value = scipy.optimize.brentq(
        lambda value: test(orbit(float(value))), low, high, xtol=1e-15, rtol=4 * np.finfo(float).eps
    )
    return float(value), orbit(float(value))


def _sequence_tests(cycle: Cycle) -> dict[tuple[Any, ...], float]:
    """Everything that is positive while the sequence holds: margins and durations, by what they belong to."""
    margins = {(m.phase, m.contact, m.kind, m.interior): m.value for m in cycle.margins()}
    durations = {(k, None, "duration", False): float(d) for k, d in enumerate(cycle.core.durations)}
    return {**margins, **durations}


def _sequence_changes(name: str, before: Placed, after: Placed, scene_at: SceneAt) -> Iterable[BranchPoint]:
    first, last = _sequence_tests(before[1]), _sequence_tests(after[1])
    for key in [key for key, value in last.items() if value < 0.0 <= first.get(key, 0.0)]:

        def test(cycle: Cycle, key: tuple[Any, ...] = key) -> float:
            # A local minimum appears as the function begins to dip: until then the phase has no such margin.
            return _sequence_tests(cycle).get(key, np.inf)

        value, cycle = _bisected(test, before, after, scene_at)
        phase, contact, event, interior = key
        if contact is None:
            contact, event = next(
                ((m.contact, m.kind) for m in cycle.margins() if m.phase == phase and m.value < 0.0),
                (None, None),
            )
        kind: Kind = "grazing" if interior else "switching"
        yield BranchPoint(name, value, kind, complex(np.nan, np.nan), contact, event, cycle)


def _bisected(test: Callable[[Cycle], float], before: Placed, after: Placed, scene_at: SceneAt) -> Placed:
    if np.isfinite(test(before[1])):
        return _root(test, before, after, scene_at)
    inside, outside = before, after
    while True:
        middle = 0.5 * (inside[0] + outside[0])
        if middle in (inside[0], outside[0]):
            return outside
        placed = (middle, _continued(outside, middle, scene_at))
        if test(placed[1]) < 0.0:
            outside = placed
        else:
            inside = placed
            if np.isfinite(test(placed[1])):
                return _root(test, inside, outside, scene_at)


def _branch_end(name: str, before: Placed, beyond: float, scene_at: SceneAt) -> Iterable[BranchPoint]:
    """Where a branch of one sequence ends: a fold, or a phase that shrinks to the touch it grew from."""
    places = [before]
    outside = beyond
    while abs(outside - places[-1][0]) > CLOSE * max(abs(outside), abs(places[-1][0])):
        middle = 0.5 * (places[-1][0] + outside)
        try:
            places.append((middle, places[-1][1].continued(scene_at(middle))))
        except OrbitError:
            outside = middle
    value, cycle = places[-1]
    multipliers = cycle.transverse_multipliers
    critical = complex(multipliers[int(np.argmin(np.abs(multipliers - 1.0)))])
    # Towards a fold 1 - m falls like the root of the distance.
    if abs(critical - 1.0) <= np.sqrt(CLOSE) * 1e2:
        yield BranchPoint(name, value, "fold", critical, None, None, cycle)
        return
    shortest = int(np.argmin(cycle.core.durations))

    def square(orbit: Cycle) -> float:
        # An event function that dips below zero by the distance stays there for a time like its root.
        return float(orbit.core.durations[shortest]) ** 2

    estimate = np.inf
    while len(places) > 1 and square(places[-1][1]) < square(places[-2][1]):
        (near, near_cycle), (value, cycle) = places[-2:]
        before_estimate = estimate
        estimate = value + square(cycle) * (value - near) / (square(near_cycle) - square(cycle))
        if abs(estimate - before_estimate) <= CLOSE**2 * abs(estimate):
            break
        try:
            further = value + 0.5 * (estimate - value)
            places.append((further, _continued((value, cycle), further, scene_at)))
        except OrbitError:
            break
    if np.isfinite(estimate):
        event = shortest - 1
        contact = int(cycle.run.events.contact[event])
        kind = str(cycle.run.events.kind[event])
        yield BranchPoint(name, float(estimate), "grazing", complex(np.nan, np.nan), contact, kind, cycle)


def basins(
    scene: Scene,
    start: State,
    *,
    position: dict[str, Any] | None = None,
    velocity: dict[str, Any] | None = None,
    stretch: float | None = None,
    limit: float | None = None,
) -> xr.DataArray:
    """Return which attractor is reached over two initial coordinates.

    Parameters
    ----------
    scene
        The scene.
    start
        State to which the values are added.
    position, velocity
        Two dofs in all, each with an array of amounts to add, m and m/s.
    stretch, limit
        See `bifurcation`.

    Returns
    -------
    xarray.DataArray
        Index of the attractor (first, second), -1 where the start violates its combination. The attribute
        ``attractors`` lists them in order of appearance: a `Cycle`, or a word for anything else.

    Raises
    ------
    InputError
        If there are not exactly two axes, or a dof is unknown.
    """
    axes = [("position", dof, values) for dof, values in (position or {}).items()]
    axes += [("velocity", dof, values) for dof, values in (velocity or {}).items()]
    if len(axes) != 2:
        raise InputError(f"basins: expected two initial coordinates, got {len(axes)}")
    (kind_a, dof_a, amounts_a), (kind_b, dof_b, amounts_b) = axes
    first = real_array(f"{kind_a}[{dof_a!r}]", amounts_a, 1)
    second = real_array(f"{kind_b}[{dof_b!r}]", amounts_b, 1)
    length = _stretch(scene, stretch)
    end = LOOKS * length if limit is None else _positive("limit", limit)
    states = [
        _displaced(_displaced(start, kind_a, dof_a, a), kind_b, dof_b, b) for a in first for b in second
    ]
    valid = [k for k, state in enumerate(states) if _is_valid(scene, state)]
    found = _settled([scene] * len(valid), [states[k] for k in valid], length, end)
    attractors: list[Cycle | str] = []
    labels = np.full(len(states), -1)
    for k, ((kind, core, growth, _), message) in zip(valid, found, strict=True):
        reached = described(kind, growth, message)[0] if core is None else Cycle(scene, core)
        labels[k] = next(
            (i for i, other in enumerate(attractors) if _is_same(reached, other)), len(attractors)
        )
        if labels[k] == len(attractors):
            attractors.append(reached)
    names = (f"{kind_a}_{dof_a}", f"{kind_b}_{dof_b}")
    return xr.DataArray(
        labels.reshape(first.size, second.size),
        dims=names,
        coords={
            names[0]: (names[0], first, {"units": "m" if kind_a == "position" else "m/s"}),
            names[1]: (names[1], second, {"units": "m" if kind_b == "position" else "m/s"}),
        },
        name="attractor",
        attrs={"attractors": tuple(attractors)},
    )


def _displaced(state: State, kind: str, dof: str, amount: float) -> State:
    change: dict[str | int, float] = {dof: float(amount)}
    return state.perturbed(position=change) if kind == "position" else state.perturbed(velocity=change)


def _is_same(a: Cycle | str, b: Cycle | str) -> bool:
    if isinstance(a, str) or isinstance(b, str):
        return a == b
    size = float(a.amplitude.max())
    apart = max(np.abs(a.core.minimum - b.core.minimum).max(), np.abs(a.core.maximum - b.core.maximum).max())
    return abs(a.period - b.period) <= SAME * a.period and apart <= SAME * size


def _is_valid(scene: Scene, state: State) -> bool:
    try:
        scene.core.check_state(state.position, state.velocity, state.combination)
    except InputError:
        return False
    return True


Outcome = tuple[Settled, str]


def _settled(scenes: list[Scene], starts: list[State], stretch: float, limit: float) -> list[Outcome]:
    parts = [(state.position, state.velocity, state.combination) for state in starts]
    found: list[Outcome] = []
    for first in range(0, len(scenes), CHUNK):
        cores = [scene.core for scene in scenes[first : first + CHUNK]]
        found += _core.settle_all(cores, parts[first : first + CHUNK], stretch, limit)
    return found


def _followed(
    scenes: list[Scene], starts: Callable[[Scene], State], stretch: float, limit: float
) -> tuple[list[Outcome], Any]:
    found: list[Outcome] = []
    restarted = np.zeros(len(scenes), dtype=bool)
    candidates: list[State] = []
    for index, scene in enumerate(scenes):
        state = next((state for state in candidates if _is_valid(scene, state)), None)
        restarted[index] = state is None and index > 0
        outcome = _settled([scene], [starts(scene) if state is None else state], stretch, limit)[0]
        found.append(outcome)
        (_, core, _, run), _ = outcome
        if core is not None:
            cycle = Cycle(scene, core)
            middles = [phase.start + 0.5 * phase.duration for phase in cycle.phases]
            candidates = [cycle.run.state(time) for time in middles]
        elif run is not None:
            position, velocity, combination = run.state(run.duration)
            candidates = [State(position, velocity, combination, scene.dofs)]
    return found, restarted


def _along(model: Model, parameter: dict[str, Any]) -> tuple[str, Real, SceneAt]:
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


def _starts(start: State | Callable[[Scene], State] | None) -> Callable[[Scene], State]:
    if start is None:
        return disturbed_sliding
    if isinstance(start, State):
        return lambda scene: start
    if callable(start):
        return start
    raise InputError(f"start: expected a State or a function from a Scene to one, got {start!r}")


def _stretch(scene: Scene, stretch: float | None) -> float:
    if stretch is not None:
        return _positive("stretch", stretch)
    moving = np.abs(complex_modes(scene).eigenvalues)
    slowest = moving[moving > 0.0].min(initial=np.inf)
    if not np.isfinite(slowest):
        raise InputError("stretch: the scene has no mode to take its time scale from; give it in s")
    return float(STRETCH * 2.0 * np.pi / slowest)


def _positive(argument: str, value: Any) -> float:
    number = real_number(argument, value)
    if not 0.0 < number < np.inf:
        raise InputError(f"{argument}: expected a positive finite time, got {number:g}")
    return number
