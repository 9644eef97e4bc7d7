"""Verdicts belong to steady sliding: its combination is the default, and points without it are marked."""

import dataclasses

import mpmath
import numpy as np
import pytest
import scipy.sparse.linalg
from click.testing import CliRunner

import stickslip as ss
from quad_block import quad_block
from stickslip.cli import main

EPS = np.finfo(float).eps
BACKWARDS = {"slider_speed": -0.025, "friction": 0.9}
PULLED = {"preload_displacement": -1e-3, "friction": 0.9}


def pad(friction=0.9, force=-10.0, slider_speed=1.0):
    """One mass on a slider: N = (K_nt K_tt^-1 F_t - F_n) / (1 - friction K_nt / K_tt) by hand."""
    return ss.Scene(
        [1.0, 1.0],
        np.array([[4e4, 1e4], [1e4, 5e4]]),
        force=[2.0, force],
        contacts=[ss.Contact(tangential=0, normal=1, friction=friction, slider_speed=slider_speed)],
    )


def test_the_default_is_the_combination_of_steady_sliding():
    scene = ss.models.two_subsystems(**BACKWARDS)
    modes = ss.complex_modes(scene)
    assert modes.combination == ss.steady_sliding(scene).combination == "--"
    assert not modes.unstable.any()
    assert ss.complex_modes(scene, "++").unstable.any()
    assert (ss.complex_modes(scene).power().eigenvalue.to_numpy() == modes.eigenvalues).all()
    assert (ss.sensitivity(scene).eigenvalue.to_numpy() == modes.eigenvalues).all()


def test_searches_along_a_parameter_slide_backwards():
    scene = ss.models.two_subsystems(**BACKWARDS)
    friction = np.linspace(0.0, 1.1, 12)
    branches = ss.sweep(scene, {"friction": friction})
    assert branches.stable.all()
    assert branches.steady_sliding.all()
    assert not ss.critical_points(scene, {"friction": (0.0, 1.1)}, kinds=("hopf",))
    assert not ss.critical_points(
        ss.models.two_subsystems, {"slider_speed": -0.025, "friction": (0.0, 1.1)}, kinds=("hopf",)
    )


def test_verdicts_of_samples_follow_each_slider():
    speeds = [0.025, -0.025]

    def model(speed):
        return ss.models.two_subsystems(friction=0.9, slider_speed=speed)

    compiled = ss.stability(ss.models.two_subsystems, {"friction": 0.9, "slider_speed": speeds})
    for found in (compiled, ss.stability(model, {"speed": speeds})):
        assert found.unstable_modes.to_numpy().tolist() == [1, 0]
        assert found.steady_sliding.all()
    study = ss.Study(
        ss.models.two_subsystems,
        {"slider_speed": speeds},
        fixed={"friction": 0.9},
        outputs=["unstable_modes", "hopf_point"],
        hopf={"friction": (0.0, 1.1)},
    ).run()
    assert study.unstable_modes.to_numpy().tolist() == [1, 0]
    assert np.isnan(study.hopf_point.to_numpy()).tolist() == [False, True]


@pytest.mark.slow
def test_no_branch_leads_from_one_direction_to_the_other():
    scene = ss.models.two_subsystems()
    for model in (scene, ss.models.two_subsystems):
        with pytest.raises(ss.InputError, match=r"slider speeds change their sign at 0, and steady sliding"):
            ss.sweep(model, {"slider_speed": np.linspace(-0.1, 0.2, 4)})
    assert ss.sweep(
        scene, {"slider_speed": [-0.1, 0.1]}, combination="++"
    ).steady_sliding.to_numpy().tolist() == [False, True]


def test_a_slider_at_rest_has_no_steady_sliding():
    scene = pad(slider_speed=0.0)
    for asked in (
        lambda: ss.complex_modes(scene),
        lambda: ss.sweep(scene, {"friction": [0.1, 0.2]}),
        lambda: ss.stability(scene, {"friction": [0.1, 0.2]}),
        lambda: ss.critical_points(scene, {"friction": (0.1, 0.2)}),
    ):
        with pytest.raises(ss.InputError, match=r"contact 0: slider_speed is 0.*combination"):
            asked()
    assert ss.complex_modes(scene, "+").combination == "+"


def test_modes_without_steady_sliding_are_refused_unless_named():
    scene = ss.models.two_subsystems(**PULLED)
    with pytest.raises(ss.NoSteadyStateError, match=r'contact 0 would pull.*-98\.98.* N.*combination="dd"'):
        ss.complex_modes(scene)
    assert ss.complex_modes(scene, "++").unstable.any()
    # That combination is an equilibrium: free of contact, both gaps are open.
    position = np.linalg.solve(scene.stiffness.toarray(), scene.force)
    assert all(scene.normal_direction(i) @ position > 0.0 for i in range(2))
    block = np.kron(np.eye(2), [[4e4, 1e4], [1e4, 5e4]])
    law = {"friction": 0.5, "slider_speed": 1.0}
    one = ss.Scene(
        np.ones(4),
        block,
        force=[2.0, 10.0, 2.0, -10.0],
        contacts=[ss.Contact(tangential=k, normal=k + 1, **law) for k in (0, 2)],
    )
    with pytest.raises(ss.NoSteadyStateError, match=r'pass combination="d[+]"'):
        ss.complex_modes(one)


def test_points_without_steady_sliding_are_marked():
    scene = ss.models.two_subsystems(**PULLED)
    branches = ss.sweep(scene, {"friction": np.linspace(0.0, 3.0, 7)})
    assert not branches.steady_sliding.any()
    points = ss.critical_points(scene, {"friction": (0.0, 3.0)})
    assert points
    assert not any(point.steady_sliding for point in points)
    for found in (
        ss.stability(ss.models.two_subsystems, {"friction": 0.9, "preload_displacement": [-1e-3, 1e-3]}),
        ss.stability(
            lambda d: ss.models.two_subsystems(friction=0.9, preload_displacement=d), {"d": [-1e-3, 1e-3]}
        ),
    ):
        assert found.steady_sliding.to_numpy().tolist() == [False, True]
        normal = [row.item() for row in found.normal_force[1]]
        assert normal == pytest.approx([98.98195370108544, 11.91], rel=1e-3)


def test_samples_without_steady_sliding_have_no_verdict():
    preload = {"preload_displacement": [-1e-3, 1e-3], "friction": [0.5, 0.9]}
    results = ss.Study(
        ss.models.two_subsystems,
        preload,
        outputs=["growth_rate", "unstable_modes", "eigenvalues", "hopf_point"],
        hopf={"friction": (0.0, 3.0)},
    ).run()
    assert results.status.to_numpy().tolist() == ["no_equilibrium"] * 2 + ["ok"] * 2
    assert np.isnan(results.growth_rate).to_numpy().tolist() == [True, True, False, False]
    assert np.isnan(results.hopf_point).to_numpy().tolist() == [True, True, False, False]
    found = ss.study.probability(results)
    assert (found.probability.item(), found.samples.item(), found.without_value.item()) == (0.5, 2, 2)
    named = ss.Study(ss.models.two_subsystems, preload, outputs=["growth_rate"], combination="++").run()
    assert not np.isnan(named.growth_rate).any()


@pytest.mark.parametrize("friction", [0.0, 0.5, 0.9])
def test_separation_is_where_the_normal_force_vanishes(friction):
    """N = 0 where K_nt F_t = K_tt F_n: 1e4 * 2 = 4e4 F_n, whatever the friction."""
    points = ss.critical_points(lambda force: pad(friction, force), {"force": (-10.0, 3.0)})
    (point,) = [point for point in points if point.kind == "separation"]
    assert point.value == pytest.approx(0.5, rel=64 * EPS)
    assert (point.contact, point.direction, point.steady_sliding) == (0, 1, True)
    assert point.name == "0"
    named = [dataclasses.replace(contact, name="pad") for contact in pad(friction, -10.0).contacts]
    points = ss.critical_points(
        lambda force: pad(friction, force).replace(contacts=named), {"force": (-10.0, 3.0)}
    )
    assert ["contact pad opens" in repr(point) for point in points if point.kind == "separation"] == [True]
    sides = ss.sweep(lambda force: pad(friction, force), {"force": [0.49, 0.51]})
    assert sides.steady_sliding.to_numpy().tolist() == [True, False]


def test_a_pole_of_the_normal_force_is_no_separation():
    """The stiffness K_tt - friction K_nt is singular at friction 4; N passes infinity there."""
    points = ss.critical_points(pad(), {"friction": (0.0, 5.0)})
    assert [(point.kind, round(point.value, 9)) for point in points if point.kind != "lock_in"] == [
        ("divergence", 4.0)
    ]
    assert ss.sweep(pad(), {"friction": [3.9, 4.1]}).steady_sliding.to_numpy().tolist() == [True, False]


@pytest.mark.parametrize("alpha", [1.0, 1e2, 1e4, 1e5, 1e6, 1e8])
def test_slow_overdamped_roots_keep_their_digits(alpha):
    """lambda^2 + alpha lambda + kappa = 0 by 50 digits; kappa = 1e-3 1/s^2."""
    scene = ss.Scene([1.0], np.array([[1e-3]]), damping=ss.Rayleigh(mass=alpha, stiffness=0.0))
    with mpmath.workdps(50):
        half = mpmath.mpf(alpha) / 2
        exact = float(-half + mpmath.sqrt(half * half - mpmath.mpf(1e-3)))
    modes = ss.complex_modes(scene).eigenvalues.real.max()
    found = ss.stability(
        lambda kappa: ss.Scene([1.0], np.array([[kappa]]), damping=scene.damping), {"kappa": [1e-3]}
    )
    for value in (modes, found.growth_rate.item()):
        # A square root, a sum and a quotient.
        assert value == pytest.approx(exact, rel=4 * EPS)


def scene_file(folder, **changes):
    path = folder / "scene.toml"
    lines = "\n".join(f"{name} = {value}" for name, value in changes.items())
    path.write_text(f'[model]\nname = "two_subsystems"\n{lines}\n', encoding="utf-8")
    return str(path)


def called(*arguments):
    return CliRunner().invoke(main, arguments)


def test_the_command_line_slides_backwards(tmp_path):
    path = scene_file(tmp_path, **BACKWARDS)
    shown = called("modes", path)
    assert "unstable" not in shown.output
    assert "Modes of --" in shown.output
    assert "12 stable, 0 unstable" in called("sweep", path, "--over", "friction=0:1.1:12").output


def test_the_command_line_says_that_steady_sliding_is_missing(tmp_path):
    path = scene_file(tmp_path, **PULLED)
    refused = called("modes", path)
    assert refused.exit_code != 0
    assert "would pull" in refused.output + str(refused.exception)
    swept = called("sweep", path, "--over", "friction=0:3:7").output
    assert "0 stable, 0 unstable, 7 without steady sliding" in swept
    studied = called("study", path, "--over", "friction={uniform=[0.3,2.5]}", "--samples", "4").output
    assert "4 no_equilibrium" in studied
    assert "no sample has a verdict" in studied


@pytest.mark.parametrize("friction", [0.1, 0.6])
def test_verdicts_of_a_mesh_have_the_forces_of_its_equilibrium(friction):
    """420 dofs, so that factors are sparse; against scipy on ``K - sum n f'``, f of the friction forces."""
    scene = quad_block(20, 10, 2, sparse=True, friction=friction)
    tangential, normal = (
        np.array([getattr(contact, name) for contact in scene.contacts]) for name in ("tangential", "normal")
    )
    held = np.zeros(scene.size, dtype=bool)
    held[normal] = True
    stiffness = scipy.sparse.csr_array(scene.stiffness)
    merged = scipy.sparse.eye_array(scene.size, format="lil")
    # A positive slider speed drags a mass forward: its row holds friction times that of the normal force.
    for t, n in zip(tangential, normal, strict=True):
        merged[t, n] = -friction
    rows = (merged.tocsr() @ stiffness)[~held][:, ~held]
    still = np.zeros(scene.size)
    still[~held] = scipy.sparse.linalg.spsolve(rows.tocsc(), (merged @ scene.force)[~held])
    expected = (stiffness @ still - scene.force)[normal]
    found = ss.stability(
        scene, {"friction": [friction], "slider_speed": [2.0]}, combination="+" * len(normal)
    )
    np.testing.assert_allclose(found.normal_force[0], expected, rtol=1e-9)
    exists = bool((expected > 0.0).all())
    assert bool(found.steady_sliding[0]) == exists
    if exists:
        assert len(ss.complex_modes(scene, near=2e5j, count=1)) == 1
    else:
        with pytest.raises(ss.NoSteadyStateError, match=f"contact {int(np.argmax(expected < 0.0))}"):
            ss.complex_modes(scene)
