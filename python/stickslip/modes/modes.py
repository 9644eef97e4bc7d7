"""Complex modes of a status combination: eigenvalues and vectors, all of them or a part."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, overload

import numpy as np
import scipy.sparse

from stickslip.faults import InputError
from stickslip.scene.checks import Complex, Flags, Index, Matrix, Real, described, real_array, shown_statuses
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
    modes, sorted by the modulus of lambda: of a conjugate pair the one whose imaginary part is positive, and
    those with a real eigenvalue; `with_conjugates` has all eigenvalues. The number of a mode is its place
    among them, from 0 on. Each of the k free coordinates gives a pair or two real eigenvalues, but slip
    without mass under a law of friction gives one: its column of M_s is zero.

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
        round the band: 0 up to rounding if they are all here. 0 of all modes; None near given points, where
        it is not known.
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
    def with_conjugates(self) -> Modes:
        """The same modes, each that oscillates followed by its conjugate: all eigenvalues of the pencil."""
        if (self.eigenvalues.imag < 0.0).any():
            return self
        places = np.repeat(np.arange(len(self)), 1 + (self.eigenvalues.imag > 0.0))
        second = np.diff(places, prepend=-1) == 0
        both = self[places]
        return replace(
            both, **{name: np.where(second, array.conj(), array) for name, array in both._columns()}
        )

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
        """Return one mode by its number, from 0 on, or several of them.

        ``modes[0:4]``, ``modes[[0, 2]]`` and ``modes[modes.unstable]`` are `Modes` again, whose numbers count
        from 0 on; `missing` and `doubts` remain those of the whole.

        Raises
        ------
        IndexError
            If there is no mode of that number, or an array of truth values has another length.
        """
        if not isinstance(number, int | np.integer):
            places = np.arange(len(self))[number]
            return replace(self, **{name: array[..., places] for name, array in self._columns()})
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

    def _columns(self) -> list[tuple[str, Any]]:
        """Return the arrays that have an entry or a column for each mode."""
        vectors = ("right_displacement", "left_displacement", "shapes")
        numbers = ("eigenvalues", "a", "b", "condition", "defective", "residual", "rounding")
        return [(name, getattr(self, name)) for name in (*vectors, *numbers)]

    def __iter__(self) -> Iterator[Mode]:
        return (self[number] for number in range(len(self)))

    def select(
        self,
        band: tuple[float, float] | None = None,
        unstable: bool | None = None,
        oscillating: bool | None = None,
    ) -> tuple[Mode, ...]:
        """Return the modes that are wanted, in their order.

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
        wanted = np.ones(len(self), dtype=bool)
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

    def mac(self, other: Modes) -> xr.DataArray:
        """Return the modal assurance criterion of every mode with every mode of another set.

        ``MAC = |x* y|^2 / (x* x) (y* y)`` over the displacements x, y of the dofs that both have, by their
        names (Allemang and Brown 1982): 1 where one shape is a complex multiple of the other, 0 where they
        are orthogonal.

        Parameters
        ----------
        other
            Modes of the same scene or of another, such as a reduced model.

        Returns
        -------
        xarray.DataArray
            (first, second), by the numbers of the modes; nan where a mode does not move these dofs.

        Raises
        ------
        InputError
            If `other` is no `Modes`, or no dof is common to both.
        """
        from stickslip.modes.shape import mac

        return mac(self, _modes(other))

    def pairing(self, other: Modes) -> xr.Dataset:
        """Return which mode is which of another set: the pairs whose MAC values have the largest sum.

        No mode is in two pairs; as many pairs are formed as the smaller set has modes (Kuhn 1955, by
        `scipy.optimize.linear_sum_assignment`).

        Parameters
        ----------
        other
            Modes of the same scene or of another.

        Returns
        -------
        xarray.Dataset
            Over ``pair``: the numbers ``first`` and ``second`` of the modes, ``mac``, ``shift`` of the
            frequency, Hz; over (pair, side) ``frequency``, Hz, and ``eigenvalue``, 1/s.

        Raises
        ------
        InputError
            As `mac`.
        """
        from stickslip.modes.shape import pairing

        return pairing(self, _modes(other))

    def orbit(
        self,
        number: int,
        dofs: Sequence[int | str] | None = None,
        *,
        periods: float = 3.0,
        samples: int = 601,
    ) -> xr.DataArray:
        """Return the motion of a mode, ``x(t) = Re(shape e^{lambda t})``: a spiral that grows or decays.

        Parameters
        ----------
        number
            Number of the mode.
        dofs
            Names or indices of dofs; None: all.
        periods
            Length in periods ``2 pi / |Im lambda|``, or in time constants ``1 / |lambda|`` if lambda is real.
        samples
            Number of instants, the first at 0.

        Returns
        -------
        xarray.DataArray
            Displacement over ``time`` (s) and ``dof``; the largest one of the shape is 1.

        Raises
        ------
        InputError
            If there is no such mode or dof, or the eigenvalue is zero.
        """
        from stickslip.modes.shape import orbit

        return orbit(self, number, dofs, periods, samples)

    def phase_lag(self, leading: int | str, lagging: int | str) -> Real:
        """Return by how much one dof lags another in every mode.

        Parameters
        ----------
        leading, lagging
            Dofs by name or index, such as tangential and normal displacement of one mass.

        Returns
        -------
        array
            ``arg(shape[leading] / shape[lagging])`` in (-pi, pi], rad, (m,); nan where one of them does not
            move. A lag of 0 or pi is a straight orbit, any other lag an ellipse.

        Raises
        ------
        InputError
            If there is no such dof.
        """
        from stickslip.modes.shape import phase_lag

        return phase_lag(self, leading, lagging)

    def power(self) -> xr.Dataset:
        """Return the power that every mode takes from contacts and loses to dampers.

        Returns
        -------
        xarray.Dataset
            Over ``mode``, and ``contact`` for the first: ``contact_power`` ``1/2 Re(T v*)``,
            ``damping_power`` ``1/2 Re(u* C u)``, ``energy`` ``1/4 (u* M u + x* K x)``, all means over the
            oscillation of ``Re(shape e^{lambda t})`` at its amplitude of t = 0, in W and J for displacements
            in m. For a real eigenvalue they are the values at t = 0 itself, without the factor 1/2.
            ``circulatory_power`` ``-1/2 Re(u* H_a x)``, into the mode, comes from the skew part of the
            circulatory forces, which has no potential (K above includes the symmetric part). ``residual``:
            contact and circulatory power less damping power less ``2 Re(lambda)`` times energy; rounding
            alone makes it differ from zero.

        Raises
        ------
        InputError
            If a contact is compliant or a dof of a contact has no mass.

        Notes
        -----
        The normal forces follow from the equations of motion, ``(lambda^2 M + lambda C + K) x = sum_i (n_i
        N_i + t_i T_i)``. Coulomb's law gives T of a contact that slides; a contact that sticks does no work.
        ``v = lambda t_i . x`` is the variation of the slip velocity. The static parts of N and T do no mean
        work.
        """
        from stickslip.modes.shape import power

        return power(self)

    def to_dataset(self) -> xr.Dataset:
        """Return what a table or a file of the modes holds.

        Returns
        -------
        xarray.Dataset
            Over ``mode``: ``eigenvalue`` 1/s, ``frequency`` Hz, ``damping_ratio``,
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
        """Return a table of frequencies, damping ratios and growth rates, a row for each mode."""
        rows = [
            (
                str(k),
                f"{self.frequencies[k]:.4f}",
                signed(self.damping_ratios[k], 6),
                signed(self.eigenvalues[k].real, 4),
                self.remark(k),
            )
            for k in range(len(self))
        ]
        headings = ("mode", "frequency, Hz", "damping ratio", "growth rate, 1/s", "")
        kinds = ["unstable" if grows else "" for grows in self.unstable]
        facts = [("missing", "not known" if self.missing is None else f"{round(self.missing, 4) + 0.0:.4f}")]
        facts += [("doubt", doubt) for doubt in self.doubts]
        whole = self.missing == 0.0 and not self.doubts
        table = Table(f"Modes of {shown_statuses(self.combination)}", headings, rows, kinds)
        return Summary([] if whole else facts, tables=[table])


def one_of_each_pair(eigenvalues: Complex) -> Flags:
    """Return which eigenvalues stand for modes: the real ones, and of a conjugate pair the upper one."""
    upper: Flags = eigenvalues.imag >= 0.0
    return upper


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


def _modes(other: Modes) -> Modes:
    if not isinstance(other, Modes):
        hint = "; complex_modes(scene) has its modes" if hasattr(other, "contacts") else ""
        raise InputError(f"other: expected Modes, got {described(other)}{hint}")
    return other
