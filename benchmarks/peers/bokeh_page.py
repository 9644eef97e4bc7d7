"""Map, loci and limit cycles of the published model on a page of Bokeh's server: the way not taken.

Bokeh's drag tool sends when a drag ends; its pan events are sent while it lasts. Each is answered by a run,
and the sources of four plots are replaced.
"""

import numpy as np
from bokeh.application import Application
from bokeh.application.handlers.function import FunctionHandler
from bokeh.events import Pan
from bokeh.layouts import column, row
from bokeh.models import ColumnDataSource, CustomJS
from bokeh.plotting import figure
from bokeh.server.server import Server

import stickslip as ss
from stickslip.show.style import COLOURS

SCENE = ss.models.two_subsystems()


def plot(**settings):
    return figure(width=560, height=330, tools="", toolbar_location=None, **settings)


def page(document):
    x, y = np.meshgrid(np.linspace(0, 3, 72), np.linspace(0.005, 0.1, 54))
    verdicts = ss.stability(SCENE, {"friction": x.ravel(), "slider_speed": y.ravel()})
    growth = verdicts.growth_rate.to_numpy().reshape(x.shape)
    stability = plot(x_range=(0, 3), y_range=(0.005, 0.1))
    stability.image([growth], x=0, y=0.005, dw=3, dh=0.095, palette="RdBu11")
    point = ColumnDataSource({"x": [1.5], "y": [0.025]})
    stability.scatter("x", "y", size=14, source=point)
    loci, branches, markers = (
        plot(),
        ColumnDataSource({"xs": [], "ys": []}),
        ColumnDataSource({"x": [], "y": []}),
    )
    loci.multi_line("xs", "ys", source=branches)
    loci.scatter("x", "y", size=8, color="red", source=markers)
    orbits = [ColumnDataSource({"xs": [], "ys": [], "colour": []}) for _ in SCENE.contacts]
    portraits = [plot() for _ in orbits]
    for portrait, orbit in zip(portraits, orbits, strict=True):
        portrait.multi_line("xs", "ys", line_color="colour", line_width=2, source=orbit)
    done = ColumnDataSource({"x": [0.0]})

    def moved(event):
        friction, speed = min(max(event.x, 0.75), 3.0), min(max(event.y, 0.005), 0.1)
        scene = SCENE.replace(friction=friction, slider_speed=speed)
        swept = ss.sweep(scene, {"friction": np.linspace(0, 3, 41)}, progress=False).eigenvalue.to_numpy()
        upper = swept[:, swept.imag.mean(axis=0) > 0.0].T
        branches.data = {"xs": list(upper.real), "ys": list(np.abs(upper) / (2.0 * np.pi))}
        modes = ss.complex_modes(scene).eigenvalues
        markers.data = {"x": modes.real, "y": np.abs(modes) / (2.0 * np.pi)}
        start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})
        try:
            cycle = ss.simulate(scene, 0.6, start).limit_cycle(3.0, time_limit=0.15)
        except ss.NotPeriodicError:
            cycle = None
        if cycle is not None:
            position, velocity, _, _, status = cycle.run.core.sample(
                np.linspace(0.0, cycle.run.duration, 257)
            )
            for i, orbit in enumerate(orbits):
                along = scene.tangential_direction(i)
                parts = np.split(np.arange(257), np.flatnonzero(np.diff(status[:, i])) + 1)
                orbit.data = {
                    "xs": [1e6 * position[part] @ along for part in parts],
                    "ys": [velocity[part] @ along for part in parts],
                    "colour": [COLOURS[chr(status[part[0], i])] for part in parts],
                }
        point.data = {"x": [friction], "y": [speed]}
        done.data = {"x": [event.x]}

    stability.on_event(Pan, moved)
    stability.js_on_event(Pan, CustomJS(code="(window.sent ??= []).push([cb_obj.x, performance.now()])"))
    drawn = (
        "requestAnimationFrame(() => setTimeout(() => (window.got ??= []).push([x, performance.now()]), 0))"
    )
    done.js_on_change("data", CustomJS(code=f"const x = cb_obj.data.x[0]; {drawn}"))
    holder = plot()
    holder.scatter("x", "x", source=done)
    document.add_root(column(row(stability, loci), row(*portraits), holder))


if __name__ == "__main__":
    server = Server({"/": Application(FunctionHandler(page))}, port=0, address="127.0.0.1")
    server.start()
    print(f"http://127.0.0.1:{server.port}/", flush=True)
    server.io_loop.start()
