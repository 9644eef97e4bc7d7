"""Who computes the chunks of a study: the threads of this process, an executor, or a dask cluster.

Each runner takes chunks as they are needed, keeps few of them under way, and hands out results in the order
in which they come.
"""

from __future__ import annotations

import concurrent.futures
import os
import pickle
from collections.abc import Callable, Iterable, Iterator
from importlib import import_module
from typing import Any, TypeAlias

from stickslip.faults import InputError, StickslipError
from stickslip.scene.checks import Real, thread_count
from stickslip.study.sample.evaluation import Columns, Evaluation

#: A chunk and its rows of parameters.
Task: TypeAlias = "tuple[int, Real]"
Result: TypeAlias = "tuple[int, Columns]"
Runner: TypeAlias = "Callable[[Evaluation, Iterable[Task]], Iterator[Result]]"

#: Chunks under way per worker of an executor or cluster: one in progress, the next one waiting.
PER_WORKER = 2
#: How often a task is begun again whose worker died.
RETRIES = 5


class WorkersLostError(StickslipError):
    """The workers of a study are gone."""


def chosen(count: int | None, pool: concurrent.futures.Executor | None, client: Any) -> Runner:
    """Return the runner that a study is told; none: threads."""
    given = [
        name
        for name, value in (("threads", count), ("executor", pool), ("client", client))
        if value is not None
    ]
    if len(given) > 1:
        raise InputError(f"run: expected one of threads, executor and client, got {' and '.join(given)}")
    if pool is not None:
        return executor(pool)
    if client is not None:
        return dask(client)
    return threads(thread_count(count))


def threads(count: int | None) -> Runner:
    """Return the runner on threads of this process, never more than a chunk has rows; None: one per core."""

    def run(evaluation: Evaluation, tasks: Iterable[Task]) -> Iterator[Result]:
        for chunk, rows in tasks:
            yield chunk, evaluation.columns(rows, None if count is None else min(count, len(rows)))

    return run


def executor(pool: concurrent.futures.Executor) -> Runner:
    """Return the runner on an executor; each of its workers computes on one thread."""
    if not isinstance(pool, concurrent.futures.Executor):
        raise InputError(f"executor: expected a concurrent.futures.Executor, got {pool!r}")
    workers = getattr(pool, "_max_workers", None) or os.cpu_count() or 1

    def run(evaluation: Evaluation, tasks: Iterable[Task]) -> Iterator[Result]:
        if isinstance(pool, concurrent.futures.ProcessPoolExecutor):
            _check_picklable(evaluation)
        waiting = iter(tasks)
        under_way: dict[concurrent.futures.Future[Columns], int] = {}
        try:
            while True:
                while len(under_way) < PER_WORKER * workers and (task := next(waiting, None)) is not None:
                    under_way[pool.submit(evaluate, evaluation, task[1])] = task[0]
                if not under_way:
                    return
                done, _ = concurrent.futures.wait(under_way, return_when=concurrent.futures.FIRST_COMPLETED)
                for future in done:
                    yield under_way.pop(future), _answer("executor", future.result)
        except concurrent.futures.BrokenExecutor as error:
            raise WorkersLostError(f"executor: {error}") from error
        finally:
            for future in under_way:
                future.cancel()

    return run


def dask(client: Any) -> Runner:
    """Return the runner on a dask cluster; chunks of a worker that dies are computed elsewhere."""
    try:
        distributed: Any = import_module("distributed")
    except ImportError:
        raise InputError("client: this needs dask; pip install 'stickslip[dask]'") from None
    if not isinstance(client, distributed.Client):
        raise InputError(f"client: expected a dask.distributed.Client, got {client!r}")

    def run(evaluation: Evaluation, tasks: Iterable[Task]) -> Iterator[Result]:
        waiting = iter(tasks)
        under_way: dict[Any, int] = {}
        results = distributed.as_completed()
        try:
            while True:
                workers = max(1, len(client.nthreads()))
                while len(under_way) < PER_WORKER * workers and (task := next(waiting, None)) is not None:
                    future = client.submit(evaluate, evaluation, task[1], pure=False, retries=RETRIES)
                    under_way[future.key] = task[0]
                    results.add(future)
                if not under_way:
                    return
                future = next(results)
                # Waits again where the worker died that held the result.
                yield under_way.pop(future.key), _answer("client", future.result)
        finally:
            results.clear()

    return run


def evaluate(evaluation: Evaluation, rows: Real) -> Columns:
    """Return the outputs of a chunk, computed on one thread: what a worker runs."""
    return evaluation.columns(rows, 1)


def _answer(argument: str, result: Callable[[], Columns]) -> Columns:
    try:
        return result()
    # What a worker raises is no answer about a sample: a module it lacks, memory it does not get, its end.
    except Exception as error:
        raise WorkersLostError(f"{argument}: {type(error).__name__}: {error}") from error


def _check_picklable(evaluation: Evaluation) -> None:
    try:
        pickle.dumps(evaluation)
    except Exception as error:
        raise InputError(
            f"executor: the model or an output cannot be sent to other processes ({error}); "
            "define it at the top level of a module"
        ) from None
