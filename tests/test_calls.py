"""What users want most, each as one call."""

import numpy as np
import pytest

import stickslip as ss

M, K, C = np.diag([1.0, 1.0]), np.array([[1.2e5, -0.4e5], [-0.4e5, 1.2e5]]), np.diag([0.5, 0.5])
F = np.array([0.0, -50.0])

BELT = ss.Contact(tangential="x1", normal="x2", friction=0.7, slider_speed=0.1)

#: The wish, the call, and the name of what it returns for the calls below it.
CALLS = [
    ("a scene from my matrices", "ss.Scene(M, K, C, F, contacts=[BELT])", "own"),
    ("a published model", "ss.models.two_subsystems(friction=1.5)", "scene"),
    ("another friction", "scene.replace(friction=1.6)", "changed"),
    ("another damping", 'ss.sweep(scene, {"damping": [0.5, 1.0]})', "damped"),
    ("steady sliding and its forces", "ss.steady_sliding(scene).friction_forces", "forces"),
    ("modes", "ss.complex_modes(scene)", "modes"),
    ("the unstable modes", "modes[modes.unstable]", "growing"),
    ("a mode drawn", "modes.plot.structure(0)", "drawn"),
    ("a mode in motion", "modes.plot.animate(0, frames=2)", "animation"),
    ("root loci", 'ss.sweep(scene, {"friction": MU})', "loci"),
    ("root loci drawn", "ss.plot(loci)", "figure"),
    ("Hopf points", 'ss.critical_points(scene, {"friction": (0, 3)}, kinds=("hopf",))', "hopf"),
    ("a stability map", 'ss.sweep(scene, {"friction": MU, "slider_speed": V})', "grid"),
    ("the map drawn", "ss.plot(grid)", "figure"),
    ("a run", "ss.simulate(scene, 0.3)", "run"),
    ("events as a table", "run.events.to_dataframe()", "events"),
    ("time histories", "run.sample([0.1, 0.2])", "sampled"),
    ("a history drawn", 'run.plot("x1")', "axes"),
    ("the limit cycle", "run.limit_cycle()", "cycle"),
    ("its stability", "cycle.stable", "stable"),
    ("its spectrum", 'run.spectrum("x1")', "lines"),
    ("a bifurcation diagram", 'ss.bifurcation(scene, {"friction": [1.5]})', "diagram"),
    ("where the energy goes", "cycle.balance()", "balance"),
    ("Monte Carlo", 'ss.Study(scene, {"friction": UNIFORM}, samples=8).run()', "results"),
    ("a result in a file", 'ss.save(run, "run.nc")', None),
    ("and back", 'ss.load("run.nc")', "read"),
    ("all on one page", 'ss.write_report(scene, "scene.html")', "page"),
]


@pytest.mark.slow
def test_every_wish_is_one_call(tmp_path, monkeypatch):
    from scipy import stats

    monkeypatch.chdir(tmp_path)
    names = {"ss": ss, "M": M, "K": K, "C": C, "F": F, "BELT": BELT, "UNIFORM": stats.uniform(0.3, 2.2)}
    names |= {"MU": np.linspace(0.0, 3.0, 9), "V": np.array([0.02, 0.03])}
    for wish, call, name in CALLS:
        # As long as a line of scipy or pandas that says as much.
        assert len(call) <= 70, wish
        given = eval(call, names)
        assert name is None or given is not None, wish
        names[name or "_"] = given
    assert names["changed"].contacts[0].friction == 1.6
    assert names["growing"].unstable.all()
    assert len(names["hopf"]) == 2
    assert names["grid"].eigenvalue.sizes["slider_speed"] == 2
    assert names["stable"] is True
    assert names["read"].identical(names["run"].to_dataset())
    # An animation that is not shown warns of it.
    names["animation"].save("mode.gif", writer="pillow")
    assert (tmp_path / "scene.html").stat().st_size > 100_000
