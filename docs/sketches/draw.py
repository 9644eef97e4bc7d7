"""Sketches of the mechanical models: contact, statuses, mass on a belt, published model.

Run as ``python docs/sketches/draw.py``; it writes the SVG files beside itself.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, Polygon, Rectangle
from numpy.typing import NDArray

HERE = Path(__file__).parent
INK, FILL, GROUND = "#222222", "#d7e3f4", "#c9c9c9"
NORMAL, TANGENTIAL, FORCE = "#0072b2", "#009e73", "#d55e00"
Point = tuple[float, float]


def arrow(axes: Axes, start: Point, end: Point, colour: str, label: str = "", at: Point = (0.0, 0.0)) -> None:
    """Draw an arrow; `at` moves its label away from the tip."""
    axes.add_patch(
        FancyArrowPatch(start, end, arrowstyle="-|>", mutation_scale=13, color=colour, linewidth=1.6)
    )
    if label:
        axes.text(end[0] + at[0], end[1] + at[1], label, color=colour, ha="center", va="center")


def spring(axes: Axes, start: Point, end: Point, label: str = "", coils: int = 5) -> None:
    """Draw a spring with its name beside its middle."""
    a, b = np.array(start), np.array(end)
    along = b - a
    across = 0.09 * np.array([-along[1], along[0]]) / np.hypot(*along)
    places = np.linspace(0.2, 0.8, 2 * coils + 1)
    zigzag = [
        a + place * along + (0.0 if k in (0, 2 * coils) else (-1.0) ** k) * across
        for k, place in enumerate(places)
    ]
    points = np.array([a, *zigzag, b])
    axes.plot(*points.T, color=INK, linewidth=1.1)
    if label:
        middle = 0.5 * (a + b) + 2.4 * across
        axes.text(*middle, label, ha="center", va="center", fontsize=9)


def hatched(axes: Axes, corners: list[Point]) -> None:
    """Draw something rigid."""
    axes.add_patch(Polygon(corners, facecolor="none", edgecolor=GROUND, hatch="////", linewidth=0.0))


def mass(axes: Axes, corner: Point, width: float, height: float, label: str) -> None:
    """Draw a mass with its name."""
    axes.add_patch(Rectangle(corner, width, height, facecolor=FILL, edgecolor=INK, linewidth=1.2))
    axes.text(corner[0] + width / 2, corner[1] + height / 2, label, ha="center", va="center")


def sketch(width: float, height: float, unit: float = 1.0) -> tuple[Figure, Axes]:
    """Return an empty sketch, `width` by `height` units."""
    figure = Figure(figsize=(width * unit, height * unit))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0.0, width), ylim=(0.0, height), aspect="equal")
    axes.axis("off")
    return figure, axes


def contact() -> Figure:
    """Draw the signs at a contact."""
    figure, axes = sketch(6.4, 3.5)
    hatched(axes, [(0.3, 0.3), (6.1, 0.3), (6.1, 0.9), (0.3, 0.9)])
    axes.plot([0.3, 6.1], [0.9, 0.9], color=INK)
    arrow(axes, (4.7, 0.6), (5.8, 0.6), INK, "slider speed $v$", (-1.75, 0.0))
    outline = [(1.4, 3.2), (1.4, 2.2), (2.4, 1.45), (3.4, 2.2), (3.4, 3.2)]
    axes.add_patch(Polygon(outline, facecolor=FILL, edgecolor=INK, linewidth=1.2))
    axes.text(1.55, 2.95, "structure", ha="left", va="center", fontsize=9)
    point = (2.4, 1.45)
    arrow(axes, point, (2.4, 2.45), NORMAL, "$n$", (0.18, 0.0))
    arrow(axes, point, (3.5, 1.45), TANGENTIAL, "$t$", (0.15, 0.17))
    axes.annotate("", (2.0, 1.45), (2.0, 0.9), arrowprops={"arrowstyle": "<->", "color": INK})
    axes.plot([1.85, 2.4], [1.45, 1.45], color=INK, linewidth=0.7, linestyle=":")
    axes.text(1.9, 1.17, "gap $g > 0$: open", ha="right", va="center", fontsize=9)
    arrow(axes, (4.5, 1.5), (4.5, 2.5), FORCE, "normal force $N \\geq 0$", (0.0, 0.2))
    arrow(axes, (4.5, 1.5), (5.5, 1.5), FORCE, "friction force $T$", (-0.1, -0.25))
    axes.text(4.5, 3.2, "forces on the structure:", ha="center", va="center", fontsize=9, color=FORCE)
    return figure


def statuses() -> Figure:
    """Draw a mass in each of the four statuses."""
    figure, axes = sketch(4.7, 4.9)
    drawn = [
        ("+", "positive sliding", "$s < 0$,  $T = +\\mu N$", 0.0, 1.0),
        ("-", "negative sliding", "$s > 0$,  $T = -\\mu N$", 0.0, -1.0),
        ("s", "sticking", "$s = 0$,  $|T| \\leq \\mu_{static} N$", 0.0, 0.0),
        ("d", "detached", "$g > 0$,  $N = T = 0$", 0.35, None),
    ]
    for k, (letter, name, holds, gap, friction) in enumerate(drawn):
        left, low = 0.2 + 2.3 * (k % 2), 2.45 * (1 - k // 2)
        hatched(
            axes, [(left, low + 0.75), (left + 1.95, low + 0.75), (left + 1.95, low + 1.0), (left, low + 1.0)]
        )
        axes.plot([left, left + 1.95], [low + 1.0, low + 1.0], color=INK)
        arrow(axes, (left + 1.35, low + 0.87), (left + 1.9, low + 0.87), INK)
        mass(axes, (left + 0.6, low + 1.0 + gap), 0.7, 0.6, letter)
        base = (left + 0.95, low + 1.1)
        if friction is not None:
            if friction:
                arrow(axes, (base[0] - 0.75 * friction, base[1]), base, FORCE)
            speeds = {1.0: 0.35, -1.0: 0.8, 0.0: 0.55}
            length = speeds[friction]
            arrow(axes, (left + 0.95, low + 1.8), (left + 0.95 + length, low + 1.8), TANGENTIAL)
        axes.text(left + 0.97, low + 2.2, name, ha="center", va="center", weight="bold", fontsize=9)
        axes.text(left + 0.97, low + 0.5, holds, ha="center", va="center", fontsize=9)
    legend = "green: velocity of the mass; black: of the slider; red: friction force"
    axes.text(2.35, 0.12, legend, ha="center", va="center", fontsize=8)
    return figure


def belt() -> Figure:
    """Draw the mass on a belt of the tutorial."""
    figure, axes = sketch(5.2, 2.2)
    hatched(axes, [(0.1, 0.6), (0.35, 0.6), (0.35, 1.6), (0.1, 1.6)])
    axes.plot([0.35, 0.35], [0.6, 1.6], color=INK)
    spring(axes, (0.35, 1.0), (2.0, 1.0), "$k$")
    mass(axes, (2.0, 0.65), 0.9, 0.7, "$m$")
    axes.plot([1.0, 4.6], [0.65, 0.65], color=INK)
    hatched(axes, [(1.0, 0.4), (4.6, 0.4), (4.6, 0.65), (1.0, 0.65)])
    arrow(axes, (3.6, 0.52), (4.5, 0.52), INK, "$v$", (0.25, 0.0))
    arrow(axes, (2.45, 2.05), (2.45, 1.37), FORCE)
    axes.text(2.62, 1.8, "10 N", color=FORCE, ha="left", va="center")
    arrow(axes, (2.9, 1.0), (3.7, 1.0), TANGENTIAL, "$x$", (0.18, 0.0))
    return figure


def two_subsystems() -> Figure:
    """Draw the published model."""
    figure, axes = sketch(9.2, 5.6)
    uppers = [(2.3, 3.3), (6.1, 3.3)]
    hatched(axes, [(0.1, 3.0), (0.35, 3.0), (0.35, 4.2), (0.1, 4.2)])
    axes.plot([0.35, 0.35], [3.0, 4.2], color=INK)
    spring(axes, (0.35, 3.6), (2.3, 3.6), "$k_1$")
    spring(axes, (3.2, 3.75), (6.1, 3.75), "$k_3$ (horizontal)")
    spring(axes, (3.2, 3.4), (6.1, 3.4), "")
    axes.text(4.65, 3.08, "$k_6$ (vertical)", ha="center", va="center", fontsize=9)
    for k, (x, y) in enumerate(uppers):
        names = ("$m_1$", "$m_3$")[k], ("$m_2$", "$m_4$")[k]
        springs = ("$k_5$", "$k_7$")[k], ("$k_2$", "$k_4$")[k], ("$k_8$", "$k_9$")[k]
        mass(axes, (x, y - 0.1), 0.9, 0.7, "")
        axes.text(x + 0.45, y + 0.38, names[0], ha="center", va="center")
        axes.text(x + 0.45, y + 0.1, ("$x_1, x_2$", "$x_5, x_6$")[k], ha="center", va="center", fontsize=9)
        hatched(axes, [(x - 0.1, 5.2), (x + 1.0, 5.2), (x + 1.0, 5.4), (x - 0.1, 5.4)])
        axes.plot([x - 0.1, x + 1.0], [5.2, 5.2], color=INK)
        spring(axes, (x + 0.45, y + 0.6), (x + 0.45, 5.2), springs[0])
        axes.text(x + 1.12, 5.3, f"preload $\\delta_{k + 1}$", ha="left", va="center", fontsize=9)
        # The contact mass on its slider, inclined as in the model.
        angle = (0.3, 0.75)[k]
        t, n = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        foot = np.array([x + 0.45, 1.25])
        corners = [foot - 0.45 * t, foot + 0.45 * t, foot + 0.45 * t + 0.6 * n, foot - 0.45 * t + 0.6 * n]
        axes.add_patch(Polygon(corners, facecolor=FILL, edgecolor=INK, linewidth=1.2))
        axes.text(*(foot + 0.3 * n), names[1], ha="center", va="center")
        plane = [foot - 1.0 * t, foot + 1.2 * t, foot + 1.2 * t - 0.22 * n, foot - 1.0 * t - 0.22 * n]
        hatched(axes, [(float(p[0]), float(p[1])) for p in plane])
        ends = np.array([foot - 1.0 * t, foot + 1.2 * t])
        axes.plot(*ends.T, color=INK)
        top = foot + 0.6 * n
        spring(axes, (float(top[0]) - 0.12, float(top[1])), (x + 0.2, y - 0.1), springs[1])
        spring(axes, (float(top[0]) + 0.25, float(top[1]) + 0.05), (x + 0.75, y - 0.1))
        axes.text(x + 1.0, y - 0.62, springs[2], ha="center", va="center", fontsize=9)
        tip = foot + 0.75 * t - 0.42 * n
        arrow(axes, _pair(tip - 0.5 * t), _pair(tip), INK, "$v$", _pair(0.2 * t))
        base = foot + 0.3 * n + 0.5 * t
        arrow(axes, _pair(base), _pair(base + 0.6 * t), TANGENTIAL, ("$x_3$", "$x_7$")[k], _pair(0.2 * t))
        start = foot + 0.65 * n - 0.32 * t
        arrow(axes, _pair(start), _pair(start + 0.55 * n), NORMAL, ("$x_4$", "$x_8$")[k], _pair(0.17 * n))
    return figure


def _pair(point: NDArray[np.float64]) -> Point:
    return float(point[0]), float(point[1])


def main() -> None:
    """Write every sketch."""
    drawings = {"contact": contact, "statuses": statuses, "belt": belt, "two-subsystems": two_subsystems}
    with rc_context({"svg.hashsalt": "stickslip", "mathtext.fontset": "cm", "font.size": 11}):
        for name, draw in drawings.items():
            draw().savefig(HERE / f"{name}.svg", metadata={"Date": None})


if __name__ == "__main__":
    main()
