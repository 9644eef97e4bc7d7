"""Modes in motion: drawings whose points the page's script moves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup, escape

from stickslip.modes.modes import Modes
from stickslip.scene.checks import Complex
from stickslip.scene.drawing.schematic import Column
from stickslip.scene.scene import Scene

#: Dofs beyond which a shape is drawn without names.
NAMED = 24
#: Width of a letter of these names, and the most letters of one that are shown.
LETTER, LETTERS = 5.6, 12
#: Length of the largest displacement in the drawing of all dofs, and in the plane.
LONG, SHORT = 44.0, 24.0
HEIGHT = 150.0
#: Least scale of a drawing, at which its names can be read; what is wider than its card scrolls.
READABLE = 0.9
#: Width from which a drawing has a row of its own.
BROAD = 480.0


def drawing(scene: Scene, modes: Modes, mode: int, columns: Sequence[Column]) -> Markup:
    """Return one mode as an SVG element: every dof, and beside it the motion in the plane.

    The points carry their displacement ``Re(shape e^{i phase})`` as ``data-x`` and ``data-y``, real and
    imaginary part; growth is left out. Without a script they stand at phase 0.

    Parameters
    ----------
    scene, modes, mode
        Which mode of which scene.
    columns
        The masses of the scene, drawn where they are; none: each contact in its own tangential and normal
        direction.
    """
    shape = modes.shapes[:, mode]
    bars, width = _all_dofs(modes.dofs, shape)
    plane, extra = _masses(shape, width, columns) if columns else _contacts(scene, shape, width)
    full = width + extra
    kind = "motion broad" if full > BROAD else "motion"
    return Markup(
        f'<svg role="img" class="{kind}" viewBox="0 0 {full:.0f} {HEIGHT:.0f}" '
        f'style="min-width: {READABLE * full:.0f}px" '
        f'aria-label="{escape(described(modes, mode))}">{bars}{plane}</svg>'
    )


def described(modes: Modes, mode: int) -> str:
    """Return in words what moves most in a mode."""
    shape = modes.shapes[:, mode]
    order = np.argsort(-np.abs(shape))[:3]
    parts = []
    for k in order:
        if np.abs(shape[k]) > 0.05:
            degrees = np.degrees(np.angle(shape[k]))
            parts.append(f"{modes.dofs[k]} {abs(shape[k]):.2f} at {degrees:.0f}°")
    return f"{modes.frequencies[mode]:.2f} Hz: largest displacements {', '.join(parts)}"


def _all_dofs(dofs: tuple[str, ...], shape: Complex) -> tuple[str, float]:
    names = [name if len(name) <= LETTERS else name[: LETTERS - 1] + "…" for name in dofs]
    if len(dofs) <= NAMED:
        step = max(26.0, LETTER * max(map(len, names)) + 6.0)
    else:
        step = max(3.0, 26.0 * NAMED / len(dofs))
    middle = 0.5 * HEIGHT
    width = step * (len(dofs) + 1)
    parts = [f'<line class="axis" x1="8" x2="{width - 8:.1f}" y1="{middle}" y2="{middle}"/>']
    for k, (name, value) in enumerate(zip(names, shape, strict=True)):
        x, reach = step * (k + 1), LONG * abs(value)
        ends = f'y1="{middle - reach:.2f}" y2="{middle + reach:.2f}"'
        parts.append(f'<line class="range" x1="{x:.1f}" x2="{x:.1f}" {ends}/>')
        if len(dofs) <= NAMED:
            parts.append(f'<text x="{x:.1f}" y="{HEIGHT - 6}">{escape(name)}</text>')
        parts.append(_point(x, middle, 0.0j, LONG * value, 4.0 if step > 8.0 else 1.5, ""))
    return "".join(parts), width


def _contacts(scene: Scene, shape: Complex, left: float) -> tuple[str, float]:
    """Draw each contact's motion along t (abscissa) and n (ordinate)."""
    shown = list(zip(range(len(scene.contacts)), map(str, scene.contact_labels()), strict=True))[:4]
    words = [
        f"contact {label if len(label) <= LETTERS else label[: LETTERS - 1] + '…'}" for _, label in shown
    ]
    parts, room = [], max(90.0, LETTER * max(map(len, words), default=0) + 12.0)
    for place, (i, _) in enumerate(shown):
        x = left + room * (place + 0.5)
        motion = [complex(d @ shape) for d in (scene.tangential_direction(i), scene.normal_direction(i))]
        parts.append(f'<text x="{x:.1f}" y="16">{escape(words[place])}</text>')
        parts.append(f'<text x="{x:.1f}" y="{HEIGHT - 6}">t →, n ↑</text>')
        parts.append(_moving(x, 0.5 * HEIGHT, motion[0], motion[1]))
    return "".join(parts), room * len(shown)


def _masses(shape: Complex, left: float, columns: Sequence[Column]) -> tuple[str, float]:
    """Draw the masses of every column in the plane, the springs between neighbours as lines."""
    upper, lower = 45.0, 108.0
    parts, points = [], []
    for k, ((name, horizontal, vertical), (below, tangential, normal), angle) in enumerate(columns):
        x = left + 55.0 + 100.0 * k
        a, b = np.cos(angle), np.sin(angle)
        points.append((name, x, upper, shape[horizontal], shape[vertical]))
        points.append(
            (
                below,
                x,
                lower,
                a * shape[tangential] - b * shape[normal],
                b * shape[tangential] + a * shape[normal],
            )
        )
        # The slider, inclined; vertical is upwards.
        parts.append(
            f'<line class="slider" x1="{x - 34 * a:.1f}" y1="{lower + 14 + 34 * b:.1f}" '
            f'x2="{x + 34 * a:.1f}" y2="{lower + 14 - 34 * b:.1f}"/>'
        )
    links = [(2 * k, 2 * k + 1) for k in range(len(columns))]
    links += [(2 * k, 2 * k + 2) for k in range(len(columns) - 1)]
    for first, second in links:
        _, x1, y1, h1, v1 = points[first]
        _, x2, y2, h2, v2 = points[second]
        ends = _ends(1, x1, y1, h1, v1) + _ends(2, x2, y2, h2, v2)
        parts.append(f'<line class="link"{ends}/>')
    parts += [_moving(x, y, h, v) for _, x, y, h, v in points]
    # Names stand on top of what moves.
    parts += [f'<text x="{x + 22:.1f}" y="{y - 14:.1f}">{name}</text>' for name, x, y, _, _ in points]
    return "".join(parts), 15.0 + 100.0 * len(columns)


def _ends(end: int, x: float, y: float, horizontal: complex, vertical: complex) -> str:
    h, v = SHORT * horizontal, SHORT * vertical
    return (
        f' x{end}="{x + h.real:.2f}" y{end}="{y - v.real:.2f}" data-p{end}="{x:.1f} {y:.1f} '
        f'{h.real:.3f} {h.imag:.3f} {v.real:.3f} {v.imag:.3f}"'
    )


def _moving(x: float, y: float, horizontal: complex, vertical: complex) -> str:
    """Draw a point with its orbit, an ellipse."""
    phases = np.exp(2j * np.pi * np.arange(48) / 48)
    xs, ys = x + SHORT * (horizontal * phases).real, y - SHORT * (vertical * phases).real
    path = "M" + "L".join(f"{px:.1f} {py:.1f}" for px, py in zip(xs, ys, strict=True)) + "Z"
    return f'<path class="orbit" d="{path}"/>' + _point(
        x, y, SHORT * horizontal, SHORT * vertical, 6.0, "mass"
    )


def _point(x: float, y: float, horizontal: complex, vertical: complex, radius: float, kind: str) -> str:
    return (
        f'<circle class="point {kind}" cx="{x:.1f}" cy="{y:.1f}" r="{radius:g}" '
        f'transform="translate({horizontal.real:.2f} {-vertical.real:.2f})" '
        f'data-x="{horizontal.real:.3f} {horizontal.imag:.3f}" '
        f'data-y="{vertical.real:.3f} {vertical.imag:.3f}"/>'
    )
