"""The base of `plot` of a result: it holds the result, a call draws the usual picture, methods the others.

A method that draws one panel takes `ax` and returns the Axes; one that draws several takes `figure` and
returns the Figure. Both are keywords, as is everything that does not name what is drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Generic, TypeVar

from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase

from stickslip.faults import InputError

Result = TypeVar("Result", covariant=True)


class Plots(Generic[Result]):
    """Pictures of a result."""

    def __init__(self, result: Result) -> None:
        self._result = result

    def __repr__(self) -> str:
        names = [name for name in dir(self) if not name.startswith("_")]
        return f"{type(self).__name__}: plot(), {', '.join(f'plot.{name}()' for name in names)}"


def axes_of(ax: Axes | None, size: tuple[float, float] | None = None) -> Axes:
    """Return the axes to draw on: those given, or new ones that a notebook shows, of a size in inches."""
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    return plt.subplots(figsize=size, layout="constrained")[1]


def panels_of(
    figure: FigureBase | None, shape: tuple[int, int], size: tuple[float, float], **options: Any
) -> tuple[Any, Sequence[Axes]]:
    """Return the figure to draw in, and as many panels as a grid of rows and columns has.

    The panels of a figure, or of a part of one, are taken as they are; if it has none, they are made with
    `options` of `Figure.subplots`. None: a new figure of a width and height, inches.
    """
    drawn = Figure(figsize=size, layout="constrained") if figure is None else figure
    if not isinstance(drawn, FigureBase):
        raise InputError(f"figure: expected a figure of matplotlib, got {drawn!r}")
    # The stubs of matplotlib know the axes of a whole figure only.
    part: Any = drawn
    if not part.axes:
        part.subplots(*shape, **options)
    if len(part.axes) < shape[0] * shape[1]:
        raise InputError(f"figure: expected {shape[0] * shape[1]} panels or none, got {len(part.axes)}")
    return part, part.axes[: shape[0] * shape[1]]


def figure_of(part: Any) -> Figure:
    """Return the whole figure in which axes or a part of a figure stand."""
    while not isinstance(part, Figure):
        part = part.figure
    return part
