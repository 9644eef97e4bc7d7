"""Many transients at once, on all cores."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sized
from dataclasses import dataclass
from functools import lru_cache
from itertools import repeat, zip_longest
from typing import Any, Literal

from rich.progress import Progress

from stickslip import _core
from stickslip.faults import InputError, StickslipError
from stickslip.motion.errors import RunError
from stickslip.scene.checks import Real, thread_count
from stickslip.scene.scene import Scene
from stickslip.scene.state import Change, State, change_vector
from stickslip.show.progress import progress_bar
from stickslip.transient.simulate import run_settings
from stickslip.transient.trajectory import Trajectory

#: Runs per thread that are in progress or wait to be handed out: enough that no thread idles when one run
#: takes as long as fifteen others, and all that is in memory at a time.
WINDOW = 16

#: Stands for what a sequence that has ended does not give.
_END: Any = object()

#: A job in progress: its position, its scene, and why it was not even submitted.
Pending = tuple[int, Scene, StickslipError | None]


@dataclass(frozen=True, repr=False)
class Outcome:
    """One run of a batch: its motion, or what kept it from having one."""

    #: position in the batch, from 0
    index: int
    scene: Scene
    #: the motion; as far as it came if it could not go on; None if it could not start
    run: Trajectory | None
    #: None where the run ended as asked
    error: StickslipError | None

    def __repr__(self) -> str:
        parts = [f"{type(self.error).__name__}: {self.error}"] if self.error else []
        parts += [repr(self.run)] if self.run else []
        return f"Outcome({self.index}: {', '.join(parts)})"


def simulate_many(
    scenes: Iterable[Scene] | Scene,
    starts: Iterable[State] | State | None = None,
    *,
    duration: float,
    position: Change | None = None,
    velocity: Change | None = None,
    method: Literal["auto", "modal", "taylor", "local"] = "auto",
    max_events: int | None = None,
    time_limit: float | None = None,
    accumulation_tolerance: float = 0.0,
    on_grazing: Literal["keep", "stop"] = "keep",
    threads: int | None = None,
    progress: bool | None = None,
) -> Iterator[Outcome]:
    """Run many scenes, on all cores, and hand out the runs one by one in order.

    Scenes may come from a generator: they are taken as they are needed. Only the runs in progress and those
    that wait for an earlier one, a few dozen, are in memory, if you keep no outcome yourself. Results do not
    depend on the number of threads. If a run cannot start or cannot go on, its `Outcome` has an `error`, and
    the other runs go on. On Ctrl-C the runs already finished are handed out first, then `KeyboardInterrupt`
    is raised; leaving the loop stops the runs in progress.

    Parameters
    ----------
    scenes
        The scenes, or one scene for every start.
    starts
        One start for each scene, or one for all; None: the sliding equilibrium of each scene.
    duration
        > 0, s.
    position, velocity
        Amounts that are added to every start, see `State.perturbed`; without them a run from equilibrium
        stays there.
    method, max_events, time_limit, accumulation_tolerance, on_grazing
        Settings of every run, see `simulate`.
    threads
        None: one per core.
    progress
        Whether to show a progress bar; None: on a terminal.

    Raises
    ------
    InputError
        If an argument is ill-posed, or there are more scenes than starts or the reverse.
    """
    batch = _core.Batch(
        *run_settings(duration, method, max_events, time_limit, accumulation_tolerance, on_grazing),
        thread_count(threads),
    )
    bar = progress_bar(progress)
    total = len(scenes) if isinstance(scenes, Sized) else len(starts) if isinstance(starts, Sized) else None
    return _outcomes(batch, _jobs(scenes, starts), position, velocity, bar, total)


def _outcomes(
    batch: _core.Batch,
    jobs: Iterator[tuple[Scene, State | None]],
    position: Change | None,
    velocity: Change | None,
    bar: Progress,
    total: int | None,
) -> Iterator[Outcome]:
    pending: deque[Pending] = deque()
    window = WINDOW * batch.threads

    # Scenes of the same dofs follow each other.
    @lru_cache(maxsize=1)
    def added(dofs: tuple[str, ...]) -> list[Real | None]:
        given = (("position", position), ("velocity", velocity))
        return [None if change is None else change_vector(name, change, dofs) for name, change in given]

    with bar:
        task = bar.add_task("runs", total=total)
        try:
            for index, (scene, start) in enumerate(jobs):
                vectors = added(scene.dofs)
                try:
                    batch.submit(scene.core, _core_start(scene, start), *vectors)
                except StickslipError as error:
                    pending.append((index, scene, error))
                else:
                    pending.append((index, scene, None))
                if len(pending) >= window:
                    yield _collected(batch, pending)
                    bar.advance(task)
            while pending:
                yield _collected(batch, pending)
                bar.advance(task)
        except KeyboardInterrupt:
            batch.stop()
            while pending:
                outcome = _collected(batch, pending)
                if outcome.run is None or outcome.run.stop_reason != "interrupted":
                    yield outcome
            raise
        finally:
            batch.stop()


def _collected(batch: _core.Batch, pending: deque[Pending]) -> Outcome:
    index, scene, refused = pending[0]
    collected = refused or batch.collect()
    pending.popleft()
    if isinstance(collected, StickslipError):
        return Outcome(index, scene, None, collected)
    position, velocity, combination, *held, core = collected
    run = Trajectory(scene, State(position, velocity, combination, scene.dofs, *held), core)
    stopped = run.stop_reason in ("failed", "chattering")
    return Outcome(index, scene, run, RunError(core.stop_message, run) if stopped else None)


def _jobs(
    scenes: Iterable[Scene] | Scene, starts: Iterable[State] | State | None
) -> Iterator[tuple[Scene, State | None]]:
    one_scene, one_start = isinstance(scenes, Scene), starts is None or isinstance(starts, State)
    if one_scene and one_start:
        return iter([(scenes, starts)])  # type: ignore[list-item]
    first: Iterable[Any] = repeat(scenes) if one_scene else _listed("scenes", scenes)
    second: Iterable[Any] = repeat(starts) if one_start else _listed("starts", starts)
    if one_scene or one_start:
        return _checked(zip(first, second, strict=False))
    return _checked(zip_longest(first, second, fillvalue=_END))


def _listed(argument: str, given: Any) -> Iterator[Any]:
    try:
        return iter(given)
    except TypeError:
        raise InputError(f"{argument}: expected a sequence, got {given!r}") from None


def _checked(jobs: Iterable[tuple[Any, Any]]) -> Iterator[tuple[Scene, State | None]]:
    for index, (scene, start) in enumerate(jobs):
        if scene is _END or start is _END:
            ended, longer = ("scenes", "starts") if scene is _END else ("starts", "scenes")
            raise InputError(f"starts: expected one per scene, got {index} {ended} and more {longer}")
        if not isinstance(scene, Scene):
            raise InputError(f"scenes[{index}]: expected a Scene, got {scene!r}")
        if start is not None and not isinstance(start, State):
            raise InputError(f"starts[{index}]: expected a State, got {start!r}")
        yield scene, start


def _core_start(
    scene: Scene, start: State | None
) -> tuple[Real, Real, str | tuple[str, list[float], list[float]]] | None:
    if start is None:
        return None
    state = start.ordered(scene.dofs)
    return state.position, state.velocity, state.statuses
