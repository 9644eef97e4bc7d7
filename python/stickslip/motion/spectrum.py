"""The discrete Fourier transform of a stretch of a motion."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from stickslip.faults import InputError
from stickslip.scene.checks import real_number, whole_number
from stickslip.scene.contact import dof_index
from stickslip.scene.scene import Scene

#: Samples of a stretch unless told otherwise, and the fewest that make a spectrum.
SAMPLES = 2**14
FEWEST = 8


class Sampled(Protocol):
    """What can be sampled from 0 to its duration: a `Motion`."""

    @property
    def scene(self) -> Scene:
        """The scene that moves."""

    @property
    def duration(self) -> float:
        """End of the motion, s."""

    def sample(self, times: ArrayLike) -> xr.Dataset:
        """Return ``position`` (time, dof), m."""


def sampled_spectrum(
    run: Sampled,
    dof: str | None,
    begin: float | None,
    end: float | None,
    samples: int,
    window: Any,
    detrend: str | None,
) -> xr.Dataset:
    """Return the discrete Fourier transform of a stretch of a run; see `Motion.spectrum`."""
    first = 0.0 if begin is None else real_number("begin", begin)
    last = run.duration if end is None else real_number("end", end)
    if not 0.0 <= first < last <= run.duration:
        raise InputError(
            f"begin, end: expected 0 <= begin < end <= {run.duration:g} s, got {first:g} and {last:g}"
        )
    samples = whole_number("samples", samples, FEWEST)
    if detrend not in ("constant", "linear", None):
        raise InputError(f"detrend: expected 'constant', 'linear' or None, got {detrend!r}")
    weights = _weights(window, samples)
    width = (last - first) / samples
    motion = run.sample(first + width * np.arange(samples)).position.to_numpy()
    names = list(run.scene.dofs)
    if dof is not None:
        chosen = dof_index("dof", dof, run.scene.dofs)
        motion, names = motion[:, [chosen]], [names[chosen]]
    if detrend == "constant":
        motion = motion - motion.mean(axis=0)
    elif detrend is not None:
        from scipy import signal  # Importing it takes longer than most spectra.

        motion = signal.detrend(motion, axis=0, type=detrend)
    coefficients = np.fft.rfft(motion * weights[:, None], axis=0) / weights.sum()
    frequency = np.fft.rfftfreq(samples, width)
    twofold = np.full(frequency.size, 2.0)
    twofold[0] = 1.0
    if samples % 2 == 0:
        twofold[-1] = 1.0
    result = xr.Dataset(
        {
            "coefficient": (("frequency", "dof"), coefficients, {"units": "m"}),
            "amplitude": (("frequency", "dof"), np.abs(coefficients) * twofold[:, None], {"units": "m"}),
        },
        coords={"frequency": ("frequency", frequency, {"units": "Hz"}), "dof": names},
        attrs={"method": "sampled", "begin": first, "end": last},
    )
    return result if dof is None else result.isel(dof=0)


def _weights(window: Any, samples: int) -> NDArray[np.float64]:
    """Return the periodic window: its first value would follow the last."""
    if isinstance(window, str) and window == "hann":
        return np.hanning(samples + 1)[:-1]
    from scipy import signal

    try:
        return np.asarray(signal.get_window(window, samples))
    except (TypeError, ValueError) as error:
        raise InputError(f"window: {error}") from None
