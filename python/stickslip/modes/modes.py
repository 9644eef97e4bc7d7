"""Complex modes of a status combination: eigenvalues and vectors, all of them or a part."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, overload

import numpy as np
import scipy.sparse

from stickslip.faults import InputError
from stickslip.scene.checks import Complex, Flags, Index, Matrix, Real, real_array, shown_statuses
from stickslip.scene.scene import Scene
from stickslip.show.summary import Shown, Summary, Table

if TYPE_CHECKING:
    import xarray as xr

    from stickslip.modes.figures import ModesPlots


class Mode(NamedTuple):
    """One complex mode."""

    #: place among the eigenvalues of its `Modes`, from 0 on
    number: int
    #: lambda, 1/s
    eigenvalue: complex
    #: ``|lambda| / 2 pi``, Hz
    frequency: float
    #: ``-Re(lambda) / |lambda|``
    damping_ratio: float
    #: whether it grows
    unstable: bool
    #: whether it has too few eigenvectors
    defective: bool
    #: displacement of every dof of the scene, (n,), the largest 1
    shape: Complex


@dataclass(frozen=True, eq=False, repr=False)
class Modes(Shown):
    """Eigenvalues and vectors of ``A y' + B y = 0``, y = (q, q'), for one status combination.

    ``A = [[C_s, M_s], [M_s, 0]]``, ``B = [[K_s, 0], [0, -M_s]]``; right vectors r = (xi, lambda xi) with
    ``lambda A r = -B r``, left vectors l = (v, lambda v) with ``lambda l' A = -l' B`` (plain transpose). m
    eigenvalues, sorted by modulus, the two of a conjugate pair adjacent, positive imaginary part first; real
    ones occur. Each of the k free coordinates gives two of them, but slip without mass under a law of
    friction gives one: its column of M_s is zero. The number of a mode is its place among them, from 0 on:
    what tables and figures show, one of each pair, is what `modes[number]` and every function of a mode
    takes.

    Attributes
    ----------
    combination
        The status combination.
    eigenvalues
        lambda, (m,), 1/s; a positive real part grows.
    right_displacement, left_displacement
        Columns xi and v, (k, m); the largest entry of each xi is 1, and v is nan where a mode is
        defective.
    a, b
        (m,), ``lambda = -b / a``; nan where a mode is defective and has no bi-orthogonal pair.
    shapes
        Displacement over all n dofs of the scene, (n, m).
    condition
        Condition number of each eigenvalue, (m,); infinite at a defective one.
    defective
        Whether an eigenvalue has too few eigenvectors, (m,).
    residual
        Relative residual of each right pair, (m,).
    rounding
        How far rounding of M_s, C_s and K_s moves each eigenvalue, (m,), 1/s. Entries that change by a
        relative epsilon, four times that of a float, change lambda by at most ``epsilon s / |a|``, where
        ``s = |v|' (|lambda|^2 |M_s| + |lambda| |C_s| + |K_s|) |xi|``, and a double one, whose a vanishes, by
        about ``sqrt(epsilon s / (|v|' |M_s| |xi|))``; the smaller one counts. Whatever says ``unstable`` or
        ``stable`` (sweeps, verdicts, studies, tables) takes a growth rate within it as zero.
    mass, damping, stiffness
        M_s, C_s and K_s, (k, k); sparse if only a part of the modes of a large scene was computed.
    missing
        Number of eigenvalues that were asked for and not found, conjugates included, by the winding of det P
        round the band: near 0 if they are all here. Not a whole number, since it is an integral by
        quadrature. 0 of all modes; None near given points, where it is not known.
    doubts
        What could not be settled about a band, in words; empty if nothing.
    scene
        The scene whose modes they are.
    """

    combination: str
    eigenvalues: Complex
    right_displacement: Complex
    left_displacement: Complex
    a: Complex
    b: Complex
    shapes: Complex
    condition: Real
    defective: Flags
    residual: Real
    rounding: Real
    mass: Matrix
    damping: Matrix
    stiffness: Matrix
    dofs: tuple[str, ...]
    scene: Scene
    missing: float | None = 0.0
    doubts: tuple[str, ...] = ()

    @cached_property
    def right(self) -> Complex:
        """Columns (xi, lambda xi), (2k, m).

        ``left.T @ A @ right = diag(a)``, ``left.T @ B @ right = diag(b)``.
        """
        return np.concatenate([self.right_displacement, self.right_displacement * self.eigenvalues])

    @cached_property
    def left(self) -> Complex:
        """Columns (v, lambda v), (2k, m)."""
        return np.concatenate([self.left_displacement, self.left_displacement * self.eigenvalues])

    @cached_property
    def state_a(self) -> Matrix:
        """A, (2k, 2k)."""
        return _blocks(self.damping, self.mass, self.mass, 0.0 * self.mass)

    @cached_property
    def state_b(self) -> Matrix:
        """B, (2k, 2k)."""
        zero = 0.0 * self.mass
        return _blocks(self.stiffness, zero, zero, -self.mass)

    @property
    def frequencies(self) -> Real:
        """``|lambda| / (2 pi)``, (m,), Hz."""
        return np.abs(self.eigenvalues) / (2.0 * np.pi)

    @property
    def damping_ratios(self) -> Real:
        """``-Re(lambda) / |lambda|``, (m,); negative where a mode grows, nan where lambda = 0."""
        with np.errstate(invalid="ignore"):
            ratios: Real = -self.eigenvalues.real / np.abs(self.eigenvalues)
        return ratios

    @property
    def unstable(self) -> Flags:
        """Whether a mode grows: whether the real part is positive by more than its `rounding`, (m,)."""
        growing: Flags = (self.eigenvalues.real > 0.0) & ~self.marginal
        return growing

    @property
    def marginal(self) -> Flags:
        """Whether the real part is zero within `rounding`, (m,), so that a mode neither grows nor decays."""
        growth = np.abs(self.eigenvalues.real)
        zero: Flags = (growth == 0.0) | (growth <= self.rounding)
        return zero

    def __len__(self) -> int:
        return self.eigenvalues.size

    @overload
    def __getitem__(self, number: int) -> Mode: ...
    @overload
    def __getitem__(self, number: slice | Sequence[int] | Sequence[bool] | Index | Flags) -> Modes: ...
    def __getitem__(
        self, number: int | slice | Sequence[int] | Sequence[bool] | Index | Flags
    ) -> Mode | Modes:
        """Return one mode by its number, its place among the eigenvalues from 0 on, or several of them.

        ``modes[0:4]``, ``modes[[0, 2]]`` and ``modes[modes.unstable]`` are `Modes` again, whose numbers count
        from 0 on; `missing` and `doubts` remain those of the whole.

        Raises
        ------
        IndexError
            If there is no mode of that number, or an array of truth values has another length.
        """
        if not isinstance(number, int | np.integer):
            return self._part(np.arange(len(self))[number])
        place = range(len(self))[number]
        return Mode(
            place,
            complex(self.eigenvalues[place]),
            float(self.frequencies[place]),
            float(self.damping_ratios[place]),
            bool(self.unstable[place]),
            bool(self.defective[place]),
            self.shapes[:, place],
        )

    def _part(self, places: Index) -> Modes:
        along_last = (
            *("eigenvalues", "right_displacement", "left_displacement", "a", "b", "shapes"),
            *("condition", "defective", "residual", "rounding"),
        )
        return replace(self, **{name: getattr(self, name)[..., places] for name in along_last})

    def __iter__(self) -> Iterator[Mode]:
        return (self[number] for number in range(len(self)))

    def select(
        self,
        band: tuple[float, float] | None = None,
        unstable: bool | None = None,
        oscillating: bool | None = None,
    ) -> tuple[Mode, ...]:
        """Return the modes that are wanted, one of each conjugate pair, in their order.

        Parameters
        ----------
        band
            Lowest and highest frequency, Hz, both included; None: all.
        unstable
            True: those that grow; False: those that do not; None: all.
        oscillating
            True: those with a conjugate; False: those with a real eigenvalue; None: all.

        Raises
        ------
        InputError
            If `band` is not two numbers, the first not above the second.
        """
        wanted = self.eigenvalues.imag >= 0.0
        if band is not None:
            ends = real_array("band", band, 1)
            if ends.shape != (2,) or not ends[0] <= ends[1]:
                raise InputError(f"band: expected (lowest, highest) in Hz, got {band!r}")
            wanted &= (self.frequencies >= ends[0]) & (self.frequencies <= ends[1])
        if unstable is not None:
            wanted &= self.unstable == unstable
        if oscillating is not None:
            wanted &= (self.eigenvalues.imag != 0.0) == oscillating
        return tuple(self[int(number)] for number in np.flatnonzero(wanted))

    @property
    def plot(self) -> ModesPlots:
        """Pictures: ``modes.plot()``, the eigenvalues; ``modes.plot.shapes()`` and others."""
        from stickslip.modes.figures import ModesPlots

        return ModesPlots(self)

    def to_dataset(self) -> xr.Dataset:
        """Return what a table or a file of the modes holds.

        Returns
        -------
        xarray.Dataset
            Over ``mode``, all m eigenvalues: ``eigenvalue`` 1/s, ``frequency`` Hz, ``damping_ratio``,
            ``unstable``, ``condition``, ``defective``; ``shape`` (mode, dof), complex, its largest entry 1.
            The attribute ``combination``.
        """
        import xarray as xr

        return xr.Dataset(
            {
                "eigenvalue": ("mode", self.eigenvalues, {"units": "1/s"}),
                "frequency": ("mode", self.frequencies, {"units": "Hz"}),
                "damping_ratio": ("mode", self.damping_ratios, {"units": "1"}),
                "unstable": ("mode", self.unstable),
                "condition": ("mode", self.condition, {"units": "1"}),
                "defective": ("mode", self.defective),
                "shape": (("mode", "dof"), self.shapes.T, {"units": "1"}),
            },
            coords={"mode": np.arange(self.eigenvalues.size), "dof": list(self.dofs)},
            attrs={"combination": self.combination},
        )

    def __repr__(self) -> str:
        return str(self.summary())

    def remark(self, mode: int) -> str:
        """Return what is special about a mode: real, unstable or marginal, defective, or nothing."""
        value = self.eigenvalues[mode]
        known = {
            "real": value.imag == 0.0,
            "unstable": self.unstable[mode],
            "marginal": self.marginal[mode],
            "defective": self.defective[mode],
        }
        return "  ".join(word for word, holds in known.items() if holds)

    def described(self, mode: int) -> str:
        """Return the frequency of a mode, and how it grows or decays, in words."""
        change = (
            f"{'grows' if self.unstable[mode] else 'decays'} at {abs(self.eigenvalues[mode].real):.3g} 1/s"
        )
        change = "neither grows nor decays" if self.marginal[mode] else change
        return f"{self.frequencies[mode]:.2f} Hz, {change}"

    def summary(self) -> Summary:
        """Return a table of frequencies, damping ratios and growth rates, one row per conjugate pair."""
        upper = np.flatnonzero(self.eigenvalues.imag >= 0.0)
        rows = [
            (
                str(k),
                f"{self.frequencies[k]:.4f}",
                signed(self.damping_ratios[k], 6),
                signed(self.eigenvalues[k].real, 4),
                self.remark(int(k)),
            )
            for k in upper
        ]
        headings = ("mode", "frequency, Hz", "damping ratio", "growth rate, 1/s", "")
        kinds = ["unstable" if self.unstable[k] and not self.marginal[k] else "" for k in upper]
        facts = [("missing", "not known" if self.missing is None else f"{round(self.missing, 4) + 0.0:.4f}")]
        facts += [("doubt", doubt) for doubt in self.doubts]
        whole = self.missing == 0.0 and not self.doubts
        table = Table(f"Modes of {shown_statuses(self.combination)}", headings, rows, kinds)
        return Summary([] if whole else facts, tables=[table])


def shown_growth(growth: Real, unstable: Flags) -> Real:
    """Return growth rates with zero in place of what is positive by rounding only."""
    shown: Real = np.where(unstable, growth, np.minimum(growth, 0.0))
    return shown


def _blocks(*quarters: Matrix) -> Matrix:
    """Return a matrix of four quarters, sparse if they are."""
    rows = [list(quarters[:2]), list(quarters[2:])]
    if scipy.sparse.issparse(quarters[0]):
        return scipy.sparse.block_array(rows, format="csr")
    return np.block(rows)


def signed(value: float, digits: int) -> str:
    """Return a number with its sign and so many decimals, or an exponent where these would be zero."""
    if value != 0.0 and abs(value) < 0.5 * 10.0**-digits:
        return f"{value:+.1e}"
    return f"{value + 0.0:+.{digits}f}"
