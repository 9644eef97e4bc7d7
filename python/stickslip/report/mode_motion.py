"""Modes in motion: drawings whose points the page's script moves."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup, escape

from stickslip.modes.modes import Modes
from stickslip.scene.checks import Complex
from stickslip.scene.drawing.schematic import LONG, NAMED, REACH, End, Schematic

#: Dofs beyond which a shape is drawn without names.
DOFS = 24
#: Width of a letter of these names, and the most letters of the name of a dof and of a body.
LETTER, LETTERS, OF_BODY = 5.6, 12, 18
#: Length of the largest displacement in the drawing of all dofs, and height of that drawing.
BAR, HEIGHT = 44.0, 150.0
#: Distance of neighbouring bodies at most and at least, and width and height in which they all fit before
#: they stand closer.
UNIT, CLOSE, WIDE, HIGH = 72.0, 24.0, 640.0, 260.0
#: Room above and below the bodies, and at their sides, for names and sliders.
ROOM = 40.0
#: Least scale of a drawing, at which its names can be read; what is wider than its card scrolls.
READABLE = 0.9
#: Width from which a drawing has a row of its own.
BROAD = 480.0


def drawing(structure: Schematic, modes: Modes, mode: int) -> Markup:
    """Return one mode as an SVG element: every dof, and beside it the structure in motion.

    The points carry their displacement ``Re(shape e^{i phase})`` as ``data-x`` and ``data-y``, real and
    imaginary part; growth is left out. Without a script they stand at phase 0.
    """
    shape = modes.shapes[:, mode]
    bars, width = _all_dofs(modes.dofs, shape)
    bodies, extra, high = _structure(structure, structure.motion(shape), width)
    full, height = width + extra, max(HEIGHT, high)
    kind = "motion broad" if full > BROAD else "motion"
    return Markup(
        f'<svg role="img" class="{kind}" viewBox="0 0 {full:.0f} {height:.0f}" '
        f'style="min-width: {READABLE * full:.0f}px" '
        f'aria-label="{escape(described(modes, mode))}">{bars}{bodies}</svg>'
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
    names = [_shortened(name, LETTERS) for name in dofs]
    if len(dofs) <= DOFS:
        step = max(26.0, LETTER * max(map(len, names)) + 6.0)
    else:
        step = max(3.0, 26.0 * DOFS / len(dofs))
    middle = 0.5 * HEIGHT
    width = step * (len(dofs) + 1)
    parts = [f'<line class="axis" x1="8" x2="{width - 8:.1f}" y1="{middle}" y2="{middle}"/>']
    for k, (name, value) in enumerate(zip(names, shape, strict=True)):
        x, reach = step * (k + 1), BAR * abs(value)
        ends = f'y1="{middle - reach:.2f}" y2="{middle + reach:.2f}"'
        parts.append(f'<line class="range" x1="{x:.1f}" x2="{x:.1f}" {ends}/>')
        if len(dofs) <= DOFS:
            parts.append(f'<text x="{x:.1f}" y="{HEIGHT - 6}">{escape(name)}</text>')
        parts.append(_point(x, middle, 0.0j, BAR * value, 4.0 if step > 8.0 else 1.5, ""))
    return "".join(parts), width


def _structure(drawing: Schematic, motion: Complex, left: float) -> tuple[str, float, float]:
    """Draw bodies, springs, walls and sliders; return the drawing, its width, and its height."""
    right = max((body.x for body in drawing.bodies), default=0.0)
    top = max((body.y for body in drawing.bodies), default=0.0) + REACH
    unit = max(min(UNIT, WIDE / (right + 1.0), HIGH / top), CLOSE)
    high = unit * top + ROOM + 10.0

    def place(x: float, y: float) -> tuple[float, float]:
        return left + ROOM + unit * x, high - ROOM - unit * y

    def end(number: int, given: End) -> str:
        h, v = (0.0j, 0.0j) if given.body is None else unit * motion[given.body]
        x, y = place(given.x, given.y)
        return (
            f' x{number}="{x + h.real:.2f}" y{number}="{y - v.real:.2f}" data-p{number}="{x:.1f} {y:.1f} '
            f'{h.real:.3f} {h.imag:.3f} {v.real:.3f} {v.imag:.3f}"'
        )

    kinds = {"spring": "link", "wall": "slider", "slider": "slider"}
    parts = [
        f'<line class="{kinds[kind]}"{end(1, first)}{end(2, last)}/>' for kind, first, last in drawing.lines()
    ]
    turn = np.exp(2j * np.pi * np.arange(48) / 48)
    for body, (h, v) in zip(drawing.bodies, unit * motion, strict=True):
        x, y = place(body.x, body.y)
        around = zip(x + (h * turn).real, y - (v * turn).real, strict=True)
        path = "M" + "L".join(f"{px:.1f} {py:.1f}" for px, py in around) + "Z"
        parts.append(f'<path class="orbit" d="{path}"/>' + _point(x, y, h, v, unit / 12.0, "mass"))
    # Names stand on top of what moves.
    for body in drawing.bodies if len(drawing.bodies) <= NAMED else ():
        x, y = place(body.x + LONG, body.y + 0.2)
        parts.append(f'<text x="{x:.1f}" y="{y:.1f}">{escape(_shortened(body.name, OF_BODY))}</text>')
    return "".join(parts), unit * right + 2.0 * ROOM + 10.0, high


def _shortened(name: str, letters: int) -> str:
    return name if len(name) <= letters else name[: letters - 1] + "…"


def _point(x: float, y: float, horizontal: complex, vertical: complex, radius: float, kind: str) -> str:
    return (
        f'<circle class="point {kind}" cx="{x:.1f}" cy="{y:.1f}" r="{radius:g}" '
        f'transform="translate({horizontal.real:.2f} {-vertical.real:.2f})" '
        f'data-x="{horizontal.real:.3f} {horizontal.imag:.3f}" '
        f'data-y="{vertical.real:.3f} {vertical.imag:.3f}"/>'
    )
