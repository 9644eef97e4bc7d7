"""A scene as a drawing of bodies, springs and sliders; a mode in it, at rest in an instant or in motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.animation import FuncAnimation
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stickslip.faults import InputError
from stickslip.modes.schematic import Schematic
from stickslip.modes.schematic import schematic as schematic_of
from stickslip.scene.checks import Complex, Real
from stickslip.scene.known import Column
from stickslip.scene.scene import Scene, checked
from stickslip.show.style import STABLE, axes_of

#: Length of the largest displacement in a drawing, in distances of neighbouring bodies.
LONG = 0.3
#: Half the length of a slider and of a wall, length of a spring to a wall in this unit; coils of a spring.
SLIDER, WALL, REACH, COILS = 0.22, 0.09, 0.4, 6
#: Bodies up to which each has its name.
NAMED = 16


def schematic(
    scene: Scene,
    displacement: Real | Complex | None = None,
    columns: Sequence[Column] = (),
    ax: Axes | None = None,
) -> Axes:
    """Draw a scene from its matrices: bodies, the springs of K between them, walls, and sliders.

    Matrices do not say where masses are. So every contact becomes a body in the bottom row, and every other
    dof a body that moves to the right, in layers by the number of springs to the next contact.

    Parameters
    ----------
    scene
        The scene.
    displacement
        Displacement of the dofs, (n,), in any unit: the largest is drawn 0.3 long. None: the scene at rest.
    columns
        Places of the masses; empty: as the scene itself says, or each contact in its own directions.
    ax
        Where to draw; None: on axes of its own.

    Raises
    ------
    InputError
        If the displacement has not one entry per dof.
    """
    drawing = schematic_of(checked(scene), columns)
    axes = axes_of(ax)
    moved = np.zeros((len(drawing.bodies), 2))
    if displacement is not None:
        values: Complex = np.asarray(displacement, dtype=complex)
        if values.shape != (scene.size,):
            raise InputError(f"displacement: expected shape ({scene.size},), got {values.shape}")
        moved = _scaled(drawing.moved(values)).real
    _still(axes, drawing)
    _drawn(axes, drawing, moved, STABLE)
    return axes


def draw_moving(scene: Scene, shape: Complex, colour: str, columns: Sequence[Column], axes: Axes) -> None:
    """Draw a complex shape (n,) at phase 0, with the orbits of all bodies."""
    drawing = schematic_of(scene, columns)
    motion = _with_orbits(axes, drawing, shape, colour)
    _drawn(axes, drawing, motion.real, colour)


def animated_shape(
    scene: Scene, shape: Complex, colour: str, title: str, columns: Sequence[Column], frames: int
) -> FuncAnimation:
    """Return one period of a complex shape (n,) in the drawing of its scene."""
    drawing = schematic_of(scene, columns)
    wide = 2.2 + 1.3 * max(body.x for body in drawing.bodies)
    figure = Figure(figsize=(max(wide, 4.0), 3.6), layout="constrained")
    axes: Axes = figure.subplots()
    motion = _with_orbits(axes, drawing, shape, colour)
    axes.set_title(title)
    parts: list[Artist] = []

    def draw(frame: int) -> tuple[Artist, ...]:
        for part in parts:
            part.remove()
        moved = (motion * np.exp(2j * np.pi * frame / frames)).real
        parts[:] = _drawn(axes, drawing, moved, colour)
        return tuple(parts)

    return FuncAnimation(figure, draw, frames=frames, interval=40, blit=False)


def _with_orbits(axes: Axes, drawing: Schematic, shape: Complex, colour: str) -> Complex:
    """Draw what does not move and the orbits; return the motion of the bodies, (bodies, 2)."""
    motion: Complex = _scaled(drawing.moved(shape)).astype(complex)
    _still(axes, drawing)
    turn = np.exp(2j * np.pi * np.arange(49) / 48)
    for body, (right, up) in zip(drawing.bodies, motion, strict=True):
        axes.plot(body.x + (right * turn).real, body.y + (up * turn).real, color=colour, linewidth=0.7)
    return motion


def _scaled(moved: Real | Complex) -> Real | Complex:
    return moved * (LONG / (float(np.abs(moved).max(initial=0.0)) or 1.0))


def _still(axes: Axes, drawing: Schematic) -> None:
    """Draw what does not move: walls, sliders, names."""
    for place, _ in drawing.walls:
        x, y = _wall(drawing, place)
        beside = y == drawing.bodies[place].y
        ends = ([x, x], [y - WALL, y + WALL]) if beside else ([x - WALL, x + WALL], [y, y])
        axes.plot(*ends, color="black", linewidth=2.0)
    for body in drawing.bodies:
        if body.contact is not None:
            a, b = np.cos(body.angle), np.sin(body.angle)
            x, y = body.x + 0.14 * b, body.y - 0.14 * a
            axes.plot(
                [x - SLIDER * a, x + SLIDER * a],
                [y - SLIDER * b, y + SLIDER * b],
                color="black",
                linewidth=2.5,
            )
        if len(drawing.bodies) <= NAMED:
            axes.annotate(body.name, (body.x + 0.12, body.y + 0.12), fontsize="small")
    if drawing.omitted:
        axes.annotate(f"{drawing.omitted} dofs are left out", (0.0, 1.0), xycoords="axes fraction", va="top")
    axes.set(xticks=[], yticks=[])
    axes.margins(0.15)
    axes.set_aspect("equal", adjustable="datalim")
    for side in axes.spines.values():
        side.set_visible(False)


def _wall(drawing: Schematic, place: int) -> tuple[float, float]:
    body = drawing.bodies[place]
    beside = body.contact is not None
    return (body.x - REACH, body.y) if beside else (body.x, body.y + REACH)


def _drawn(axes: Axes, drawing: Schematic, moved: Real, colour: str) -> list[Artist]:
    """Draw what moves: springs and bodies."""
    places = np.array([(body.x, body.y) for body in drawing.bodies]) + moved
    ends = [(places[a], places[b]) for a, b, _ in drawing.springs]
    ends += [(places[place], np.array(_wall(drawing, place))) for place, _ in drawing.walls]
    parts: list[Artist] = []
    for first, last in ends:
        path = _coil(first, last)
        parts += axes.plot(path[:, 0], path[:, 1], color="0.45", linewidth=0.9, zorder=1)
    parts.append(axes.scatter(places[:, 0], places[:, 1], s=70, color=colour, edgecolor="white", zorder=3))
    return parts


def _coil(first: Real, last: Real) -> Real:
    along = last - first
    across = np.array([-along[1], along[0]]) / (float(np.hypot(*along)) or 1.0)
    inner = np.linspace(0.2, 0.8, 2 * COILS)
    sides = np.where(np.arange(2 * COILS) % 2, 0.035, -0.035)
    zigzag = first + inner[:, None] * along + sides[:, None] * across
    return np.vstack([first, first + 0.2 * along, zigzag, first + 0.8 * along, last])
