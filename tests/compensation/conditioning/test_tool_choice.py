"""Which unknowns static postures carry, which are set aside, and what widens an interval."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.compensation.conditioning import (
    ToolModel,
    choose_tool,
    refuse_mistakes,
)
from elastocal.compensation.conditioning.tool_choice import blunders
from elastocal.compensation.conditioning.tool_fit import TOOL_UNKNOWNS, fit_tool, rotation_off
from elastocal.errors import CompensationError
from support.by_day import some_by_day
from support.static_postures import PlantedTool, turned

TOOL = PlantedTool(R_flange_sensor=np.eye(3))
LIGHT = PlantedTool(mass=12.16 / 9.80665, R_flange_sensor=np.eye(3), force_bias=np.ones(3))
RICHEST = ToolModel(rotation=True, drift=True, cross_talk=0.01)


def raw(seed=0, count=12, tool=TOOL, noise=1.0, cross_talk=0.0):
    rng = np.random.default_rng(seed)
    sensor = replace(tool, matrix=tool.cross_talk(cross_talk, rng))
    return sensor.raw(turned(count, rng), rng, noise), sensor


def off(fit):
    angles = rotation_off(np.eye(3), fit.R_flange_sensor)
    return np.abs(angles), np.array([fit.half_width[name] for name in TOOL_UNKNOWNS[1:4]])


@pytest.mark.parametrize("seed", some_by_day(range(4), every=4))
def test_cross_talk_of_one_percent_is_no_rotation(seed):
    postures, sensor = raw(seed, cross_talk=0.01)
    found = choose_tool(postures, None, RICHEST)
    angles, widths = off(found.fit)
    assert np.all(angles <= widths)
    assert found.fit.model.has_matrix
    assert abs(found.fit.mass - sensor.mass) <= found.fit.half_width["mass"]


@pytest.mark.slow
def test_the_weight_is_known_to_the_noise_although_the_matrix_is_not():
    postures, sensor = raw(1, count=31, cross_talk=0.01)
    fit = choose_tool(postures).fit
    x, y, z = fit.mass * fit.centre
    weight = np.vstack([fit.mass * np.eye(3), [[0, -z, y], [z, 0, -x], [-y, x, 0]]])
    x, y, z = sensor.mass * sensor.centre
    truth = np.vstack([sensor.mass * np.eye(3), [[0, -z, y], [z, 0, -x], [-y, x, 0]]])
    left = (fit.matrix @ weight - sensor.matrix @ truth) * 9.80665
    assert np.abs(left[:3]).max() < 1.0
    assert np.abs(left[3:]).max() < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("seed", some_by_day([3, 8]))
def test_without_a_matrix_intervals_reach_as_far_as_beside_its_prior(seed):
    # Few postures, hardly turned: they cannot show a cross-talk of 1 %, and do not ask for it.
    rng = np.random.default_rng(seed)
    postures = TOOL.raw(turned(7, rng, 0.3), rng)
    without = choose_tool(postures, None, ToolModel(drift=True)).fit.half_width
    found = choose_tool(postures).fit
    beside = fit_tool(postures, None, ToolModel(cross_talk=0.01))
    assert not found.model.has_matrix
    for name, value, other in (
        ("mass", found.mass, beside.mass),
        ("centre of mass z", found.centre[2], beside.centre[2]),
    ):
        # In the worst case the two are equal by construction: a rounding decides between them.
        reach = abs(value - other) + beside.half_width[name]
        assert found.half_width[name] >= (1.0 - 1e-9) * reach
        assert found.half_width[name] > without[name]


@pytest.mark.slow
@pytest.mark.parametrize(("count", "angle"), [(8, 0.4), (8, 1.0), (14, 0.4), (31, 1.0)])
def test_intervals_cover_the_tool_under_a_cross_talk_of_one_percent(count, angle):
    names = [name for name in TOOL_UNKNOWNS if "rotation" not in name]
    covered = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        tool = replace(TOOL, matrix=TOOL.cross_talk(0.01, rng))
        fit = choose_tool(tool.raw(turned(count, rng, angle), rng)).fit
        off = [
            [fit.mass - tool.mass],
            fit.force_bias - tool.force_bias,
            fit.centre - tool.centre,
            fit.moment_bias - tool.moment_bias,
        ]
        covered.append(np.abs(np.concatenate(off)) <= [fit.half_width[name] for name in names])
    assert 0.90 <= np.mean(covered) <= 0.99


@pytest.mark.slow
def test_a_weight_determines_at_most_eighteen_directions_of_the_matrix():
    fit = choose_tool(raw(1, count=31, cross_talk=0.01)[0]).fit
    assert 10 <= fit.matrix_rank <= 18
    assert fit.matrix_determined.max() <= 1.0


def test_a_clean_sensor_gets_no_matrix_and_no_drift():
    found = choose_tool(raw(2)[0], None, RICHEST)
    assert found.fit.model == ToolModel()
    assert found.set_aside == ()


@pytest.mark.slow
def test_a_rotation_is_freed_only_where_it_was_asked_for():
    sensor = replace(TOOL, R_flange_sensor=Rotation.from_euler("z", 4.0, degrees=True).as_matrix())
    postures, _ = raw(0, tool=sensor)
    asked, default = choose_tool(postures, None, RICHEST), choose_tool(postures)
    angles, widths = off(asked.fit)
    assert abs(angles[2] - np.radians(4.0)) <= widths[2]
    np.testing.assert_array_equal(default.fit.R_flange_sensor, np.eye(3))
    assert "put the sensor" in " ".join(default.notes)


def test_a_blunder_of_80_newton_on_a_light_tool_is_named_and_set_aside():
    postures, _ = raw(3, count=20, tool=LIGHT, noise=0.56)
    force = postures.force.copy()
    force[6, 1] += 80.0
    found = choose_tool(postures.read_as(force=force))
    (aside,) = found.set_aside
    assert aside.posture == 7
    assert aside.force == pytest.approx(80.0, abs=2.0)
    assert found.fit.mass == pytest.approx(LIGHT.mass, abs=found.fit.half_width["mass"])
    assert found.fit.force_scatter == pytest.approx(0.28, rel=0.3)


@pytest.mark.parametrize("seed", range(20))
def test_noise_is_not_set_aside(seed):
    assert blunders(raw(seed, count=8 + seed, cross_talk=0.02)[0]) == ()


def test_a_drift_is_found_and_leaves_the_mass_alone():
    postures, _ = raw(4, count=24)
    drift = postures.course[:, None] * [8.0, -5.0, 12.0]
    found = choose_tool(postures.read_as(force=postures.force + drift))
    assert found.fit.model.drift
    np.testing.assert_allclose(found.fit.drift[:3], [8.0, -5.0, 12.0], atol=1.5)
    assert abs(found.fit.mass - TOOL.mass) <= found.fit.half_width["mass"]


def test_residuals_that_resemble_their_neighbours_widen_the_intervals():
    postures, _ = raw(5, count=40, noise=0.1)
    rng = np.random.default_rng(6)
    walk = np.zeros((40, 3))
    for k in range(1, 40):
        walk[k] = 0.8 * walk[k - 1] + 0.5 * rng.normal(size=3)
    still = choose_tool(postures)
    found = choose_tool(postures.read_as(force=postures.force + walk))
    assert found.serial_correlation > 0.2
    assert "resembles its neighbour's" in " ".join(found.notes)
    assert still.notes == ()


def test_halves_that_disagree_are_within_the_interval():
    postures, _ = raw(7, count=40, tool=LIGHT, noise=0.2)
    half = np.arange(40) < 20
    # The zero of the sensor moved with the arm the other way round in between.
    u = postures.gravity_flange / 9.80665
    force = postures.force + np.where(half[:, None], 0.6 * u, -0.6 * u)
    fit = choose_tool(postures.read_as(force=force)).fit
    reach = 9.80665 * fit.half_width["mass"]
    assert reach > 0.5
    assert abs(9.80665 * fit.mass - 12.16) < reach


@pytest.mark.slow
@pytest.mark.parametrize(
    ("order", "reason"),
    some_by_day(
        [([3, 0, 1, 2], "in the order w x y z, their columns are named x y z w"),
         ([1, 2, 3, 0], "in the order x y z w, their columns are named w x y z")]
    ),
)  # fmt: skip
def test_quaternions_of_the_other_order_are_told(order, reason):
    postures, _ = raw(8)
    read = Rotation.from_quat(
        Rotation.from_matrix(postures.R_base_flange).as_quat()[:, order]
    ).as_matrix()
    wrong = replace(postures, R_base_flange=read, quaternions=True)
    with pytest.raises(CompensationError, match=reason):
        refuse_mistakes(wrong, choose_tool(wrong).fit)
    right = replace(postures, quaternions=True)
    refuse_mistakes(right, choose_tool(right).fit)
