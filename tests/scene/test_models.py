import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import stickslip as ss


def test_two_subsystems_is_the_model_of_the_reference_solution(standard):
    scene = ss.models.two_subsystems(friction=1.5, slider_speed=0.025, preload_displacement=1e-3)
    given_stiffness = standard.scene.stiffness
    # Entries are sums of at most five products of three rounded factors.
    rounding = 8 * np.finfo(float).eps * np.abs(given_stiffness).max()
    assert np.abs(scene.stiffness.toarray() - given_stiffness).max() <= rounding
    assert scene.mass.tolist() == standard.scene.mass.tolist()
    assert scene.force == pytest.approx(standard.scene.force, rel=1e-15)
    assert scene.damping == standard.scene.damping


def springs(parts, links, wall):
    """(stiffness, elongation) of every spring of a chain, as the design's table lists them."""
    size = 4 * len(parts)
    for i, part in enumerate(parts):
        x = np.eye(size)[4 * i : 4 * i + 4]
        a, b = np.cos(part.inclination), np.sin(part.inclination)
        horizontal, vertical = a * x[2] - b * x[3], b * x[2] + a * x[3]
        if i == 0:
            yield wall, x[0]
        yield part.ceiling_stiffness, x[1]
        yield part.vertical_stiffness, x[1] - vertical
        yield part.horizontal_stiffness, x[0] - horizontal
        if i + 1 < len(parts):
            following = np.eye(size)[4 * i + 4 : 4 * i + 8]
            yield links[i].horizontal_stiffness, x[0] - following[0]
            yield links[i].vertical_stiffness, x[1] - following[1]


@given(st.integers(1, 5), st.integers(0, 2**32 - 1))
def test_the_stiffness_of_a_chain_is_that_of_its_springs(count, seed):
    rng = np.random.default_rng(seed)
    draw = rng.uniform
    parts = [
        ss.models.Subsystem(
            upper_mass=draw(0.1, 1.0),
            contact_mass=draw(0.1, 1.0),
            inclination=draw(-1.5, 1.5),
            vertical_stiffness=draw(1e4, 1e6),
            horizontal_stiffness=draw(1e4, 1e6),
            ceiling_stiffness=draw(1e4, 1e6),
            preload_displacement=draw(0.0, 1e-3),
            external_force=draw(-10.0, 10.0),
        )
        for _ in range(count)
    ]
    links = [
        ss.models.Link(horizontal_stiffness=draw(1e4, 1e6), vertical_stiffness=draw(1e4, 1e6))
        for _ in range(count - 1)
    ]
    scene = ss.models.chain(parts, links, wall_stiffness=2e6, friction=0.5, slider_speed=0.1)
    expected = sum(k * np.outer(e, e) for k, e in springs(parts, links, 2e6))
    assert scene.stiffness.toarray() == pytest.approx(expected, rel=0, abs=1e-15 * 8 * np.abs(expected).max())
    assert scene.mass.tolist() == [m for p in parts for m in [p.upper_mass] * 2 + [p.contact_mass] * 2]
    pressed = [-p.ceiling_stiffness * p.preload_displacement - p.external_force for p in parts]
    assert scene.force[1::4] == pytest.approx(pressed, rel=1e-14)
    assert np.count_nonzero(np.delete(scene.force, np.arange(1, 4 * count, 4))) == 0
    assert [(c.tangential, c.normal) for c in scene.contacts] == [
        (4 * i + 2, 4 * i + 3) for i in range(count)
    ]


def test_every_parameter_of_two_subsystems_has_a_name_and_one_value_per_contact():
    scene = ss.models.two_subsystems(
        friction=(0.5, 0.6),
        slider_speed=(0.1, 0.2),
        static_friction=(0.7, 0.8),
        restitution=(0.1, 0.2),
        preload_displacement=(1e-3, 2e-3),
        external_force=(3.0, 4.0),
        damping=2e-5,
        upper_mass=(0.1, 0.2),
        contact_mass=(0.3, 0.4),
        inclination=(0.5, 0.6),
        wall_stiffness=1e6,
        horizontal_stiffness=(2e6, 3e6),
        vertical_stiffness=(4e6, 5e6),
        ceiling_stiffness=(6e6, 7e6),
        link_horizontal_stiffness=8e6,
        link_vertical_stiffness=9e6,
        impact_friction=True,
    )
    assert scene.mass.tolist() == [0.1, 0.1, 0.3, 0.3, 0.2, 0.2, 0.4, 0.4]
    assert scene.force[[1, 5]] == pytest.approx([-6003.0, -14004.0], rel=1e-15)
    assert scene.damping == ss.Rayleigh(stiffness=2e-5)
    assert scene.impact_friction
    assert [(c.friction, c.slider_speed, c.static_friction, c.restitution) for c in scene.contacts] == [
        (0.5, 0.1, 0.7, 0.1),
        (0.6, 0.2, 0.8, 0.2),
    ]
    k = scene.stiffness.toarray()
    assert [k[0, 0], k[1, 1]] == pytest.approx([1e6 + 2e6 + 8e6, 4e6 + 6e6 + 9e6], rel=1e-15)
    assert [k[4, 4], k[5, 5]] == pytest.approx([3e6 + 8e6, 5e6 + 7e6 + 9e6], rel=1e-15)


def test_labels_as_printed_give_other_frequencies():
    frequencies = ss.complex_modes(ss.models.two_subsystems(friction=0.0, labels="printed")).frequencies
    assert np.abs(frequencies[:2] - [44.58, 122.60]).max() < 0.01  # one unit of the last printed digit


def test_a_preload_displacement_acts_as_the_force_of_its_spring():
    by_displacement = ss.models.two_subsystems(preload_displacement=(1e-3, 2e-3))
    by_force = ss.models.two_subsystems(preload_displacement=0.0, external_force=(60.0, 360.0))
    assert by_displacement.force == pytest.approx(by_force.force, rel=1e-15)
