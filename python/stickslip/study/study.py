"""Studies: a model over distributions of its parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeAlias

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from stickslip.faults import InputError, Interrupted, StudyError
from stickslip.scene.checks import Real, check_memory, finite_time, real_array, whole_number
from stickslip.scene.parameters.family import Family, Model
from stickslip.scene.parameters.values import interval
from stickslip.scene.scene import Scene
from stickslip.show.progress import Rate, progress_bar
from stickslip.study.parameters import parameters as listed_parameters
from stickslip.study.perturbation import eigenvalue_moments
from stickslip.study.run import identity, runners
from stickslip.study.run.store import Layout, Store, opened
from stickslip.study.sample.evaluation import Evaluation, Labels, Settings
from stickslip.study.sample.outputs import OUTPUTS
from stickslip.study.sample.outputs import outputs as listed_outputs
from stickslip.study.samplers import unit_design
from stickslip.transient.trajectory import FURTHER

if TYPE_CHECKING:
    import os
    from concurrent.futures import Executor

Sampler: TypeAlias = Literal["random", "latin_hypercube", "sobol", "saltelli", "morris", "grid"]
#: Samples per chunk unless told otherwise: some hundredths of a second of verdicts, some tenths of motions.
VERDICTS, MOTIONS = 16384, 128
#: Rows tried for the names of dofs and contacts.
FIRST = 1000


class Study:
    """A model over distributions of its parameters, or over a grid of them.

    Sample i depends only on seed, sampler, number of samples and i, and its outputs depend only on its
    parameters. The results are therefore the same, to the last bit, for any number of threads or workers, any
    chunks and any order, and for a run that was killed and continued. The results record the processor, the
    versions and whatever else their last bits depend on.

    Parameters
    ----------
    model
        A `Scene`, whose parameters are the fields of its contacts (``friction``, ``friction_0``);
        ``ss.models.two_subsystems`` or ``ss.models.chain``, with all numbers of subsystems, links and
        contacts (``vertical_stiffness`` of all subsystems, ``vertical_stiffness_1`` of one), or a
        `functools.partial` of these; or any function from keywords to a `Scene`. All but the last are
        evaluated in compiled code.
    parameters
        Name to frozen ``scipy.stats`` distribution; tuple of names to `study.GaussianCopula` or frozen
        ``multivariate_normal``; or name to values (k,), for a grid of all combinations.
    outputs
        Names (those of `Study.OUTPUTS`), functions of the trajectory, or mappings of names to functions or
        `study.Output`.
    samples
        Number of samples; for ``saltelli`` and ``morris`` the base number, see `size`. None for a grid.
    seed
        >= 0.
    sampler
        ``random``; ``latin_hypercube``; ``sobol``, scrambled; ``saltelli``, the design of Sobol' indices with
        ``samples (p + 2)`` rows for p parameters (Saltelli 2002; Saltelli et al. 2010); ``morris``,
        ``samples`` trajectories of ``p + 1`` rows over levels of probability (Morris 1991); or points of the
        unit cube of your own, (n, p).
    sampler_options
        ``sobol``: ``scramble``, a bool; ``saltelli``: ``second_order``, with which it has ``samples (2 p +
        2)`` rows; ``morris``: ``levels``, an even number, 4 if not given.
    fixed
        Other arguments of the model.
    combination
        Status combination for all stability outputs, computed whether or not steady sliding exists in it;
        None: that of steady sliding, in which each slider speed gives the sign of its contact. A sample
        without steady sliding then has no verdict and the status ``no_equilibrium``.
    hopf
        For ``hopf_point``: the friction that varies and its range, such as ``{"friction": (0.0, 3.0)}``.
    duration
        Duration of each motion, s; outputs of motions need it.
    further
        How much longer a motion is followed if it has not settled, s; None: 10 durations.
    position, velocity
        Amounts added to the sliding equilibrium at the start, see `State.perturbed`; None: the fastest
        growing mode is added, see `disturbed_sliding`.
    method, max_events
        Settings of the motions, see `simulate`.

    Raises
    ------
    InputError
        If an argument is ill-posed, or no scene is well posed.

    Notes
    -----
    A sample that cannot be computed has a ``status`` other than ``ok`` and its ``reason``; the outputs that
    could be computed are kept. The statuses are ``ill_posed`` (there is no such scene), ``no_equilibrium``
    (steady sliding does not exist: a contact would open, or a slider rests), ``eigenvalues`` (they were not
    found), ``max_events``, ``unbounded``, ``chattering``, ``failed`` (the motion has no consistent
    continuation) and ``error`` (a function raised).
    """

    #: Outputs by name, with dimensions, type and meaning.
    OUTPUTS: ClassVar = OUTPUTS

    def __init__(
        self,
        model: Model,
        parameters: Mapping[Any, Any],
        *,
        outputs: Sequence[Any] | Mapping[str, Any] | Callable[..., Any] | str = (
            "growth_rate",
            "unstable_modes",
        ),
        samples: int | None = None,
        seed: int = 0,
        sampler: Sampler | ArrayLike | None = None,
        sampler_options: Mapping[str, Any] | None = None,
        fixed: Mapping[str, Any] | None = None,
        combination: str | None = None,
        hopf: Mapping[str, tuple[float, float]] | None = None,
        duration: float | None = None,
        further: float | None = None,
        position: Any = None,
        velocity: Any = None,
        method: Literal["auto", "modal", "taylor"] = "auto",
        max_events: int | None = None,
    ) -> None:
        self.parameters = listed_parameters(parameters)
        self.outputs = listed_outputs(outputs)
        for column in self.outputs.columns:
            if column.name in self.parameters.names:
                raise InputError(f"outputs: {column.name!r} is the name of a parameter of the study as well")
        self.family = _family(model, self.parameters.names, fixed)
        self.seed = whole_number("seed", seed, 0)
        self.sampler_options = dict(sampler_options or {})
        self.samples: int | None = None
        if isinstance(sampler, str | None):
            self.sampler = sampler or ("grid" if self.parameters.levels else "random")
            self.design = self._design(samples)
        else:
            self.sampler = "points"
            self.design = self._points(sampler, samples)
        self.family.check_angles(self.parameters.names, self.design)
        moved, times = self._moved(hopf), self._times(duration, further)
        if method not in ("auto", "modal", "taylor"):
            raise InputError(f"method: expected 'auto', 'modal' or 'taylor', got {method!r}")
        start = None if position is None and velocity is None else (position, velocity)
        limit = None if max_events is None else whole_number("max_events", max_events, 0)
        self.settings = Settings(combination, moved, *times, method, limit, start)
        Labels.of(self.scene, self.settings)

    def _design(self, samples: int | None) -> Real:
        grid = bool(self.parameters.levels)
        if grid != (self.sampler == "grid"):
            raise InputError(
                f"sampler: {self.sampler!r} and parameters given as "
                f"{'values' if grid else 'distributions'} do not go together"
            )
        if grid:
            if samples is not None:
                raise InputError(f"samples: a grid has all combinations of its values, got {samples!r}")
            return self.parameters.grid()
        self.samples = whole_number("samples", samples, 1)
        # The design and its values.
        check_memory("samples", 2 * self.samples * len(self.parameters.names), samples)
        if self.sampler in ("saltelli", "morris") and self.parameters.dependent:
            raise InputError(f"sampler: {self.sampler!r} takes independent parameters only")
        width = len(self.parameters.names)
        try:
            return self.parameters.values(
                unit_design(self.sampler, self.samples, width, self.seed, self.sampler_options)
            )
        except MemoryError:
            raise InputError(
                f"samples: memory does not hold the design of {self.samples} samples of {width} parameters"
            ) from None

    def _points(self, given: Any, samples: int | None) -> Real:
        points = real_array("sampler", given, 2)
        width = len(self.parameters.names)
        if self.parameters.levels or self.sampler_options or samples is not None:
            raise InputError(
                "sampler: points go with distributions alone, without samples or sampler_options"
            )
        if points.shape[1] != width or len(points) < 1:
            raise InputError(f"sampler: expected points of shape (n, {width}), got {points.shape}")
        if not ((points >= 0.0) & (points <= 1.0)).all():
            raise InputError("sampler: expected points in the unit cube")
        return self.parameters.values(points)

    def _moved(self, hopf: Any) -> tuple[str, float, float] | None:
        """Return the friction that moves for Hopf points, and the ends of its range."""
        if not self.outputs.asks("hopf"):
            return None
        if not isinstance(hopf, Mapping) or len(hopf) != 1:
            raise InputError(
                "hopf: expected the friction to move and its range, such as {'friction': (0.0, 3.0)}, "
                f"got {hopf!r}"
            )
        ((name, ends),) = hopf.items()
        lower, upper = interval(f"hopf[{name!r}]", ends)
        if lower < 0.0:
            raise InputError(f"hopf[{name!r}]: friction must be >= 0, got {lower!r}")
        return name, lower, upper

    def _times(self, duration: float | None, further: float | None) -> tuple[float, float]:
        """Return how long motions last, and how much longer they are followed, s."""
        if not self.outputs.moves:
            return 0.0, 0.0
        if duration is None:
            raise InputError("duration: outputs of motions need it, in s")
        length = finite_time("duration", duration)
        return length, FURTHER * length if further is None else finite_time("further", further, 0.0)

    @property
    def size(self) -> int:
        """Number of samples in all."""
        return len(self.design)

    @cached_property
    def scene(self) -> Scene:
        """The first scene of the study that is well posed.

        Raises
        ------
        InputError
            If the first thousand samples give none.
        """
        error: Exception | None = None
        for row in self.design[:FIRST]:
            try:
                return self.scene_of(row)
            # A function may raise anything, there as at any other sample.
            except Exception as refused:
                error = error or refused
        raise InputError(f"model: none of the first samples gives a scene; the first one: {error}") from error

    def scene_of(self, row: ArrayLike) -> Scene:
        """Return the scene of one value for each parameter, (parameters,), in their order.

        Raises
        ------
        InputError
            If there is no such scene; a function may raise anything.
        """
        values = real_array("row", row, 1).tolist()
        return self.family.scene(dict(zip(self.parameters.names, values, strict=True)))

    @cached_property
    def evaluation(self) -> Evaluation:
        """What a worker needs to know."""
        labels = Labels.of(self.scene, self.settings)
        return Evaluation(self.family, self.parameters.names, self.outputs, self.settings, labels)

    def run(
        self,
        store: str | os.PathLike[str] | None = None,
        *,
        threads: int | None = None,
        executor: Executor | None = None,
        client: Any = None,
        chunk: int | None = None,
        progress: bool | None = None,
    ) -> xr.Dataset:
        """Compute all samples that the store does not hold yet, and return the results.

        Parameters
        ----------
        store
            Directory of a zarr store; None: results are kept in memory. A store that holds a part of this
            study is continued, whatever ended the run that wrote it; at most the chunks under way are
            computed again.
        threads
            Number of threads of this process; None: one per core.
        executor
            A ``concurrent.futures.Executor``, whose workers compute instead, each on one thread.
        client
            A ``dask.distributed.Client``, whose cluster computes instead.
        chunk
            Samples that are computed and written at a time; None: 16384 without motions, else 128. A store
            keeps the one it was made with.
        progress
            Whether to show progress; None: on a terminal.

        Returns
        -------
        xarray.Dataset
            Over ``sample``: the outputs, ``status`` and ``reason``; the parameters as coordinates.
            Attributes, in JSON: ``identity`` (model with all its numbers or its source, parameters, sampler,
            seed, outputs, settings), ``machine``, ``versions`` and ``scene``, the first of them. From a store
            the values are read when they are used.

        Raises
        ------
        InputError
            If an argument is ill-posed, the store holds another study or cannot be made, or another process
            writes to it.
        StudyError
            If the workers are lost or the store cannot be written, as on a full disk; what is complete is in
            its `partial`.
        Interrupted
            On Ctrl-C, a ``KeyboardInterrupt``; what is complete is in its `partial`.
        """
        default = MOTIONS if self.outputs.moves or self.outputs.asks("hopf") else VERDICTS
        length = min(default if chunk is None else whole_number("chunk", chunk, 1), self.size)
        runner = runners.chosen(threads, executor, client)
        with opened(store, self._layout(), length) as results, progress_bar(progress, Rate()) as bar:
            pending = results.pending()
            done = self.size - sum(len(self._rows(results, k)) for k in pending)
            task = bar.add_task("samples", total=self.size, completed=done)
            tasks = ((k, self._rows(results, k)) for k in pending)
            try:
                for k, columns in runner(self.evaluation, tasks):
                    results.write(k, columns)
                    bar.advance(task, len(columns["status"]))
            except KeyboardInterrupt as error:
                partial = results.dataset()
                raise Interrupted(self._so_far(partial), partial) from error
            # Errors of a model are results: an error of the system is one of the store.
            except (runners.WorkersLostError, OSError) as error:
                partial = results.dataset()
                raise StudyError(f"{error}; {self._so_far(partial)}", partial) from error
            return results.dataset()

    def eigenvalue_moments(self) -> xr.Dataset:
        """Return mean and covariance of the eigenvalues of sliding, to first order of the spread.

        Returns
        -------
        xarray.Dataset
            Over ``mode``, the modes at the mean of the parameters: ``eigenvalue`` there, 1/s; ``covariance``
            (mode, part, other) of real and imaginary part, 1/s^2; ``growth_deviation``, standard deviation of
            the real part, 1/s; ``frequency_deviation`` of the modulus over 2 pi, Hz; ``share`` (parameter,
            mode) of the variance of the real part that a parameter has alone (sums to 1 where they are
            independent); ``gradient`` (parameter, mode). Values of a defective mode are nan: its derivative
            is unbounded, so first order says nothing about it.

        Raises
        ------
        InputError
            If a distribution has no variance, or the model is not smooth at the mean.
        """
        return eigenvalue_moments(self.parameters, self.scene_of, self.settings.combination)

    def _rows(self, results: Store, chunk: int) -> Real:
        return self.design[chunk * results.chunk : (chunk + 1) * results.chunk]

    def _so_far(self, partial: xr.Dataset) -> str:
        complete = int((partial.status != "pending").sum())
        return f"{complete} of {self.size} samples are complete"

    def _layout(self) -> Layout:
        evaluation, labels = self.evaluation, self.evaluation.labels
        columns = evaluation.outputs.columns
        dims = {dim for column in columns for dim in column.dims}
        coords: dict[str, tuple[str, Any, dict[str, str]]] = {
            name: ("sample", np.ascontiguousarray(values), self.family.units(name))
            for name, values in zip(self.parameters.names, self.design.T, strict=True)
        }
        for dim, names in (("dof", labels.dofs), ("contact", labels.contacts)):
            if dim in dims:
                coords[dim] = (dim, list(names), {})
        return Layout(
            columns,
            {column.name: labels.size(column, evaluation.outputs) for column in columns},
            coords,
            self.size,
            identity.plain(self.identity),
            identity.plain(identity.machine()),
            {"versions": identity.versions(), "scene": identity.described_scene(self.scene)},
        )

    @cached_property
    def identity(self) -> dict[str, Any]:
        """What another run has to have in common to continue this one."""
        return {
            "model": identity.described_model(self.family.model, self.family.arguments),
            "parameters": self.parameters.described(),
            "sampler": self.sampler,
            "sampler_options": self.sampler_options,
            "samples": self.samples,
            "seed": self.seed,
            "outputs": self.outputs.described(),
            "settings": {
                name: repr(value) if name == "start" else value for name, value in vars(self.settings).items()
            },
            "version": identity.release_series(),
        }

    def __repr__(self) -> str:
        outputs = ", ".join(column.name for column in self.outputs.columns[:-2])
        names = ", ".join(self.parameters.names)
        return f"Study({self.size} samples, {self.sampler}, seed {self.seed}: {names} -> {outputs})"


def _family(model: Any, names: tuple[str, ...], fixed: Mapping[str, Any] | None) -> Family:
    arguments = dict(fixed or {})
    if isinstance(model, Scene) and arguments:
        raise InputError(f"fixed: a Scene takes no further arguments, got {list(arguments)}")
    for name in arguments:
        if name in names:
            raise InputError(f"fixed: {name!r} is a parameter of the study as well")
    family = Family(model, arguments)
    family.check(names)
    if isinstance(family.given, partial) and callable(family.model):
        # What a partial sets, a parameter sets again: it is no part of what identifies the model.
        kept = {name: value for name, value in family.arguments.items() if name not in names}
        family = Family(family.model, kept)
    return family
