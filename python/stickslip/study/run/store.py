"""Where the results of a study are kept: in memory, or in a zarr store that survives whatever ends the run.

A chunk is written variable by variable, each file under another name first and then renamed, and its status
last: a chunk whose samples have a status is complete, and any other counts as absent, wherever the process
ends.
"""

from __future__ import annotations

import contextlib
import json
import os
import warnings
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stickslip.faults import InputError
from stickslip.scene.checks import FORMAT_KEY, FORMAT_VERSION, check_format_version, package
from stickslip.show.replaced_file import draft_of
from stickslip.study.run.identity import differences
from stickslip.study.run.zarr_folder import STORE, check_zarr
from stickslip.study.sample.evaluation import Columns
from stickslip.study.sample.outputs import Column

if TYPE_CHECKING:
    from filelock import BaseFileLock

#: Parameters as equal as their distributions are on machines of other types, in parts of the largest.
SAME = 1e-12
#: Status of a sample that is not complete.
PENDING = "pending"


@dataclass
class Layout:
    """The variables of a study and what is written with them."""

    columns: tuple[Column, ...]
    sizes: dict[str, tuple[int, ...]]
    coords: dict[str, tuple[str, Any, dict[str, str]]]
    size: int
    #: What another run has to have in common to continue this one.
    identity: dict[str, Any]
    #: What the last bits depend on besides.
    machine: dict[str, Any]
    #: Everything else that travels with the results, JSON.
    attrs: dict[str, Any]

    @property
    def frame(self) -> xr.Dataset:
        """The coordinates and attributes of the results; attributes are JSON, which every format takes."""
        rows = {"identity": self.identity, "machine": self.machine, **self.attrs}
        text = {name: value if isinstance(value, str) else json.dumps(value) for name, value in rows.items()}
        return xr.Dataset(coords=self.coords, attrs=text)


class Store(ABC):
    """Keeps chunks of samples."""

    #: Samples per chunk.
    chunk: int
    #: Which chunks are complete.
    complete: NDArray[np.bool_]
    lock: BaseFileLock | None = None

    def pending(self) -> list[int]:
        """Return the chunks that are not complete, ascending."""
        return [int(k) for k in np.flatnonzero(~self.complete)]

    def write(self, chunk: int, columns: Columns) -> None:
        """Keep a chunk, its status last: a sample with a status is whole."""
        first = chunk * self.chunk
        for name in sorted(columns, key="status".__eq__):
            self.array(name)[first : first + len(columns[name])] = columns[name]
        self.complete[chunk] = True

    @abstractmethod
    def array(self, name: str) -> Any:
        """Return what keeps a variable."""

    @abstractmethod
    def dataset(self) -> xr.Dataset:
        """Return everything complete; the status of other samples is ``pending``."""

    def close(self) -> None:
        """Let others continue the study."""
        if self.lock is not None:
            self.lock.release()


class MemoryStore(Store):
    """Results as arrays."""

    def __init__(self, layout: Layout, chunk: int) -> None:
        self.layout = layout
        self.chunk = chunk
        self.complete = np.zeros(-(-layout.size // chunk), dtype=bool)
        self._arrays = {
            column.name: column.filled(layout.size, *layout.sizes[column.name]) for column in layout.columns
        }
        self._arrays["status"][:] = PENDING

    def array(self, name: str) -> Any:
        """Return what keeps a variable."""
        return self._arrays[name]

    def dataset(self) -> xr.Dataset:
        """Return everything complete."""
        return self.layout.frame.assign(
            {
                column.name: (("sample", *column.dims), self._arrays[column.name], column.attrs)
                for column in self.layout.columns
            }
        )


class ZarrStore(Store):
    """Results as a zarr group, format 3, which ``xarray.open_zarr`` reads.

    A store that exists keeps its own number of samples per chunk.
    """

    def __init__(self, path: str | os.PathLike[str], layout: Layout, chunk: int) -> None:
        zarr = package("zarr", "store")
        self.path = Path(path)
        self.layout = layout
        if not self.path.exists() or (self.path.is_dir() and not any(self.path.iterdir())):
            self._create(zarr, chunk)
        self.lock = _locked(self.path)
        try:
            self._group = self._opened(zarr)
        except BaseException:
            self.close()
            raise
        self.chunk = int(self._group["status"].chunks[0])
        statuses = np.asarray(self._group["status"][:: self.chunk], dtype=object)
        self.complete = np.asarray(statuses != PENDING, dtype=bool)

    def array(self, name: str) -> Any:
        """Return what keeps a variable."""
        return self._group[name]

    def dataset(self) -> xr.Dataset:
        """Return everything complete; numbers are read from the disk as they are used."""
        found: xr.Dataset = xr.open_zarr(self.path, chunks=None, consolidated=False, zarr_format=3)
        # As objects: numpy's own strings do not go together with nan in `xarray.where`.
        words = {
            column.name: found[column.name].astype(object)
            for column in self.layout.columns
            if column.dtype == "str"
        }
        labels = {name: entry for name, entry in self.layout.coords.items() if entry[0] != "sample"}
        results = found.assign(words).assign_coords(labels)
        results.attrs = {name: text for name, text in found.attrs.items() if name not in (FORMAT_KEY, STORE)}
        return results

    def _create(self, zarr: Any, chunk: int) -> None:
        """Write everything that is known before the first sample, under another name until it is complete."""
        layout = self.layout
        self.path.parent.mkdir(parents=True, exist_ok=True)
        try:
            with draft_of(self.path) as draft:
                labels = {
                    name: (dim, np.asarray(values, dtype=object))
                    for name, (dim, values, _) in layout.coords.items()
                    if np.asarray(values).dtype.kind in "UO"
                }
                frame = layout.frame.assign_coords(labels).assign_attrs(
                    {FORMAT_KEY: FORMAT_VERSION, STORE: True}
                )
                frame.to_zarr(draft, mode="w-", zarr_format=3, consolidated=False)
                # Not by xarray: only of dask arrays, which hold no texts, does it write the frame alone.
                group = zarr.open_group(draft, mode="r+", zarr_format=3)
                for column in layout.columns:
                    rest = layout.sizes[column.name]
                    group.create_array(
                        column.name,
                        shape=(layout.size, *rest),
                        chunks=(chunk, *(max(1, length) for length in rest)),
                        dtype=str if column.dtype == "str" else column.dtype,
                        fill_value=PENDING if column.name == "status" else column.missing,
                        dimension_names=("sample", *column.dims),
                        attributes=column.attrs,
                    )
                with contextlib.suppress(OSError):
                    self.path.rmdir()
                try:
                    draft.rename(self.path)
                except OSError:
                    # Another writer was quicker: what it made is opened, and its lock decides.
                    if not (self.path / "zarr.json").is_file():
                        raise
        except OSError as error:
            raise InputError(f"store: {self.path} cannot be made: {error}") from error

    def _opened(self, zarr: Any) -> Any:
        try:
            check_zarr(self.path)
            group = zarr.open_group(self.path, mode="r+", zarr_format=3)
            check_format_version(group.attrs.get(FORMAT_KEY))
            theirs = json.loads(group.attrs["identity"])
            machine = json.loads(group.attrs["machine"])
        except (KeyError, ValueError, TypeError, RecursionError, OSError) as error:
            raise InputError(f"store: {self.path} holds something that is not a study: {error}") from error
        different = differences(self.layout.identity, theirs)
        if different:
            raise InputError(f"store: {self.path} holds another study; {'; '.join(different)}")
        self._compare_design(group)
        for difference in differences(self.layout.machine, machine):
            warnings.warn(
                f"store: {self.path} was begun on another machine or by another patch release, so last bits "
                f"may differ; {difference}",
                stacklevel=2,
            )
        return group

    def _compare_design(self, group: Any) -> None:
        """Refuse other values of the parameters: another version of a package may draw other numbers."""
        for name, (dim, ours, _) in self.layout.coords.items():
            if dim != "sample":
                continue
            theirs = group[name][:]
            close = np.abs(ours - theirs) <= SAME * np.abs(ours).max()
            if not close.all():
                k = int(np.argmin(close))
                raise InputError(
                    f"store: {self.path} holds another study; {name} of sample {k}: {ours[k]!r} here, "
                    f"{theirs[k]!r} there, from the same distributions and seed; other versions of packages?"
                )


def _locked(path: Path) -> BaseFileLock:
    """Hold a store for this run, until it ends or its process does in whatever way.

    The lock is on a file beside the chunks of an array, where no reader looks.
    """
    filelock = package("filelock", "store")
    lock: BaseFileLock = filelock.FileLock(path / "status" / ".lock", timeout=0.0)
    try:
        lock.acquire()
    except filelock.Timeout:
        raise InputError(f"store: another process or thread is writing to {path}") from None
    except OSError as error:
        raise InputError(f"store: {path} holds something that is not a study") from error
    return lock


@contextlib.contextmanager
def opened(path: Any, layout: Layout, chunk: int) -> Iterator[Store]:
    """Open the store of a study: in memory where there is no path."""
    store: Store = MemoryStore(layout, chunk) if path is None else ZarrStore(path, layout, chunk)
    try:
        yield store
    finally:
        store.close()
