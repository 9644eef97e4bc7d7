"""Forty calls of a newcomer: a model of their own, every analysis, files, pictures; public names only."""

import matplotlib as mpl
import numpy as np
import pytest

import stickslip as ss

mpl.use("agg")


def belt(stiffness=(300.0, 200.0), coupling=250.0, friction=0.3, progress=1.0):
    """A mass on a belt with two coupled springs at a right angle: `progress` scales the load."""
    tangential, normal = stiffness
    return ss.Scene(
        mass=[1.0, 1.0, 0.1],
        stiffness=[
            [tangential + coupling, -coupling, 0.0],
            [-coupling, normal + coupling, 0.0],
            [0.0, 0.0, 50.0],
        ],
        damping=ss.Rayleigh(stiffness=2e-4),
        force=[0.0, -20.0 * progress, 0.0],
        contacts=[
            ss.Contact(tangential="along", normal="across", friction=friction, slider_speed=0.5, name="belt")
        ],
        dofs=["along", "across", "beside"],
    )


def brake(friction=1.5, vertical_stiffness=(4.5e5, 3.0e4)):
    """The model of the tutorial, as a function of one's own."""
    return ss.models.two_subsystems(friction=friction, vertical_stiffness=vertical_stiffness)


@pytest.mark.slow
def test_forty_calls(tmp_path):
    own = belt()
    assert own.contact_labels() == ["belt"]
    rest = ss.steady_sliding(own)
    assert float(rest.contact_forces(own).normal_force.sel(contact="belt")) > 0.0
    assert [mode.unstable for mode in ss.complex_modes(own)] == [False] * 2
    louder = own.replace(friction_belt=0.6)
    assert louder.contacts[0].friction == 0.6
    assert ss.sweep(belt, {"friction": np.linspace(0.0, 1.0, 11), "progress": 1.1}).sizes["friction"] == 11
    assert ss.sweep(own, {"friction_belt": np.linspace(0.0, 1.0, 5)}).sizes["branch"] == 4
    assert ss.stability(belt, {"stiffness_0": np.linspace(200.0, 400.0, 7)}).sizes["sample"] == 7

    scene = brake()
    modes = ss.complex_modes(scene)
    (squeal,) = modes.select(band=(0, 2e3), unstable=True)
    assert modes[squeal.number].frequency == squeal.frequency
    quiet = ss.complex_modes(brake(friction=1.4))
    assert (modes.pairing(quiet).mac > 0.9).all()
    assert modes.orbit(squeal.number).sizes["dof"] == 8
    assert modes.phase_lag("x1", "x2").size == len(modes)
    assert (
        abs(ss.complex_modes(scene).power().residual).max()
        < 1e-6 * abs(ss.complex_modes(scene).power().damping_power).max()
    )
    assert len(ss.status_table(scene, ["++", "+s"]).data.combination) == 2
    assert ss.equations_of(scene, "ss").mass.shape == (4, 4)

    loci = ss.sweep(brake, {"friction": np.linspace(0.5, 2.5, 21)})
    (onset, *_) = ss.critical_points(brake, {"friction": (0.5, 2.5)}, kinds=("hopf",))
    assert onset.value == pytest.approx(0.70156717308523)
    kinds = {point.kind for point in ss.critical_points(scene, {"friction": (0.5, 2.5)})}
    assert "hopf" in kinds
    slopes = ss.sensitivity(brake, {"vertical_stiffness_1": 3.0e4, "friction": 1.5})
    assert slopes.parameter.to_numpy().tolist() == ["vertical_stiffness_1", "friction"]
    assert ss.sensitivity(scene, entries="stiffness").entry_derivative.dims == ("mode", "row", "column")

    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})
    run = ss.simulate(scene, 0.6, start)
    assert run.events[0].name == "0"
    assert run.events.to_dataframe().shape[0] == len(run.events)
    aligned = run.sample()
    assert aligned.time.size >= 2 * np.unique(run.events.time).size
    assert run.sample(np.linspace(0.0, 0.6, 11)).sizes["time"] == 11
    assert run.state(0.3).contact_forces(scene).sizes["contact"] == 2
    assert abs(run.balance().residual) < 1e-9
    assert run.energy([0.1, 0.2]).sizes["time"] == 2
    assert ss.modal_energy(run, [0.1]).sizes["time"] == 1
    assert run.spectrum("x2").sizes["frequency"] > 10
    assert [
        one.run is not None for one in ss.simulate_many([scene], duration=0.1, velocity={"x1": 1e-3})
    ] == [True]

    cycle = run.limit_cycle()
    assert cycle.stable
    assert {phase.name for phase in cycle.phases} <= {"0", "1"}
    assert cycle.harmonics(8).sizes["harmonic"] == 9
    diagram = ss.bifurcation(brake, {"friction": [1.4, 1.5]})
    assert all(found is not None for found in diagram.cycles)
    branch = ss.continuation(cycle, {"friction": (1.5, 1.52)}, brake, step=0.5)
    assert branch.end == "range"
    assert branch.points == ()
    reached = ss.basins(scene, start=start, velocity={"x1": [0.0, 1e-3], "x5": [0.0, 1e-3]})
    assert reached.map.shape == (2, 2)
    assert ss.mode_selection(scene, np.linspace(1e-5, 1e-4, 2), phases=2).modes.sizes["mode"] == 1

    study = ss.Study(brake, {"friction": [1.0, 1.5], "vertical_stiffness_1": [3.0e4, 3.1e4]})
    results = study.run(progress=False)
    assert ss.study.unstacked(results).growth_rate.shape == (2, 2)

    ss.save(ss.Case(ss.models.two_subsystems, run={"duration": 0.1}), tmp_path / "brake.toml")
    case = ss.load(tmp_path / "brake.toml").replace(vertical_stiffness_1=3.1e4)
    assert case.simulate().duration == 0.1
    ss.save(own, tmp_path / "belt.toml")
    assert ss.load(tmp_path / "belt.toml").scene.dofs == own.dofs
    for name, answer in {
        "loci": loci,
        "diagram": diagram.to_dataset(),
        "basins": reached.to_dataset(),
        "cycle": cycle.to_dataset(),
        "events": run.events.to_dataset(),
        "modes": modes.to_dataset(),
    }.items():
        ss.save(answer, tmp_path / f"{name}.nc")
        assert set(ss.load(tmp_path / f"{name}.nc").data_vars) == set(answer.data_vars), name
    for drawn in (run, cycle, modes, run.balance(), diagram, branch, reached):
        assert drawn.plot().get_xlabel()
    for figure in (ss.plot(loci), ss.plot(results), run.plot.history()):
        ss.save(figure, tmp_path / "figure.png")
        assert (tmp_path / "figure.png").stat().st_size > 1000
    mpl.pyplot.close("all")
    with pytest.raises(ss.InputError, match=r"fricton: .*nearest: friction"):
        ss.bifurcation(scene, {"fricton": [1.0]})
