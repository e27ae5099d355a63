import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.compensation.conditioning import (
    ToolModel,
    fit_tool,
    refuse_mistakes,
    refuse_other_readings,
    tool_doubts,
)
from elastocal.errors import CompensationError
from support.static_postures import PlantedTool, turned

TOOL = PlantedTool()
FREE = ToolModel(rotation=True)
POINTS = {"tool centre point": np.array([0.0, 0.0, 0.35]), "flange": np.array([0.0, 0.0, -0.08])}


@pytest.fixture
def postures():
    rng = np.random.default_rng(0)
    return TOOL.raw(turned(12, rng), rng)


def check(postures, **known):
    refuse_mistakes(
        postures, fit_tool(postures, TOOL.R_flange_sensor, FREE), TOOL.R_flange_sensor, **known
    )


def in_base(postures, vectors):
    return np.einsum("nij,nj->ni", postures.R_base_flange @ TOOL.R_flange_sensor, vectors)


def test_sound_postures_pass(postures):
    check(postures, expected_centre=TOOL.centre, points=POINTS)


@pytest.mark.parametrize("seed", range(20))
def test_few_sound_postures_pass(seed):
    rng = np.random.default_rng(seed)
    check(TOOL.raw(turned(4, rng, angle=0.5), rng), expected_centre=TOOL.centre, points=POINTS)


def test_a_light_tool_on_a_biased_sensor_passes():
    tool, rng = PlantedTool(mass=1.5), np.random.default_rng(1)
    check(tool.raw(turned(12, rng), rng))


def test_wrenches_in_base_are_named(postures):
    turned_too = postures.read_as(
        in_base(postures, postures.force), in_base(postures, postures.moment)
    )
    with pytest.raises(CompensationError, match=r"in base already: .*\(40 kg along gravity"):
        check(turned_too)


def test_wrenches_in_base_with_the_bias_gone_are_named(postures):
    tared = postures.read_as(
        in_base(postures, postures.force - TOOL.force_bias),
        in_base(postures, postures.moment - TOOL.moment_bias),
    )
    with pytest.raises(CompensationError, match="in base already"):
        check(tared)


def test_a_turned_sign_is_named(postures):
    with pytest.raises(CompensationError, match="the sign of the wrenches is turned"):
        check(postures.read_as(-postures.force, -postures.moment))


def test_a_left_handed_frame_is_named(postures):
    with pytest.raises(CompensationError, match="left-handed frame"):
        check(postures.read_as(postures.force * [1, 1, -1]))


def test_a_turned_sign_is_named_where_postures_turn_about_one_axis_only():
    rng = np.random.default_rng(2)
    R = Rotation.from_euler("y", np.linspace(2.0, 4.0, 9)[:, None]).as_matrix()
    tool = PlantedTool(R_flange_sensor=np.eye(3))
    postures = tool.raw(R, rng)
    refuse_mistakes(postures, fit_tool(postures, None, FREE))
    wrong = postures.read_as(-postures.force, -postures.moment)
    with pytest.raises(CompensationError, match=r"sign of the wrenches is turned.*from where it"):
        refuse_mistakes(wrong, fit_tool(wrong, None, FREE))


def test_inverse_orientations_are_named(postures):
    with pytest.raises(CompensationError, match="invert them"):
        check(postures.read_as(R_base_flange=np.swapaxes(postures.R_base_flange, 1, 2)))


def test_moments_in_base_are_named(postures):
    with pytest.raises(CompensationError, match="moments seem to be in base"):
        check(postures.read_as(moment=in_base(postures, postures.moment)))


@pytest.mark.parametrize("point", POINTS)
def test_moments_about_another_point_are_named(postures, point):
    moved = postures.read_as(moment=postures.moment - np.cross(POINTS[point], postures.force))
    with pytest.raises(CompensationError, match=f"moments seem to be about the {point}"):
        check(moved, expected_centre=TOOL.centre, points=POINTS)


def test_moments_in_another_unit_are_named(postures):
    with pytest.raises(CompensationError, match=r"centre of mass comes out .* another unit"):
        check(postures.read_as(moment=1e3 * postures.moment))


def test_equal_postures_with_a_bias_upward_are_undetermined_and_no_mistake():
    tool, rng = PlantedTool(force_bias=np.array([0.0, 0.0, -900.0])), np.random.default_rng(3)
    check(tool.raw(np.repeat(turned(1, rng), 5, axis=0), rng))


@pytest.mark.parametrize(("axis", "gain"), [(0, 0.0), (2, 0.0), (0, 1.4), (2, 0.7)])
def test_a_dead_or_scaled_force_axis_is_named(postures, axis, gain):
    force = postures.force.copy()
    force[:, axis] *= gain
    wrong = postures.read_as(force=force)
    with pytest.raises(CompensationError, match=f"force_{'xyz'[axis]} shows .* kg of the tool"):
        refuse_mistakes(wrong, fit_tool(wrong, TOOL.R_flange_sensor), TOOL.R_flange_sensor)


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_cross_talk_of_moments_is_no_mistake_of_a_force_axis(seed):
    rng = np.random.default_rng(seed)
    matrix = PlantedTool.cross_talk(0.015, rng)
    tool = PlantedTool(mass=60.0, centre=np.array([0.0, 0.0, 0.3]), matrix=matrix)
    refuse_other_readings(tool.raw(turned(20, rng, 0.15), rng), tool.R_flange_sensor, 0.1)


def test_without_the_mass_forces_in_kgf_are_not_seen():
    rng = np.random.default_rng(0)
    light = TOOL.raw(turned(12, rng), rng)
    light = light.read_as(light.force / 9.80665)
    fit = fit_tool(light, TOOL.R_flange_sensor)
    assert tool_doubts(light, fit) == ()
    assert "are the forces in kgf?" in tool_doubts(light, fit, TOOL.mass)[0]


class TestFewDirections:
    """A campaign that tilts its tool to three attitudes alone, as on the example of roughing."""

    LEVER = 0.13

    def postures(self, seed):
        rng = np.random.default_rng(seed)
        attitudes = Rotation.from_rotvec(np.outer([0.0, 0.5, 1.0], [0.0, np.pi, 0.0])).as_matrix()
        return TOOL.raw(np.repeat(attitudes, (9, 5, 1), axis=0), rng)

    @pytest.mark.parametrize("seed", range(40))
    def test_a_cross_talk_of_five_percent_is_no_mistake(self, seed):
        sound = self.postures(seed)
        matrix = 0.05 * np.random.default_rng(seed).standard_normal((6, 6))
        wrench = np.hstack([sound.force, sound.moment / self.LEVER])
        wrench = wrench + (wrench - wrench.mean(axis=0)) @ matrix.T
        talked = sound.read_as(wrench[:, :3], self.LEVER * wrench[:, 3:])
        refuse_other_readings(talked, TOOL.R_flange_sensor, self.LEVER)

    @pytest.mark.parametrize("pair", [(0, 1), (0, 2), (1, 2)])
    def test_exchanged_axes_are_found_all_the_same(self, pair):
        sound, order = self.postures(0), [0, 1, 2]
        order[pair[0]], order[pair[1]] = pair[::-1]
        with pytest.raises(CompensationError, match="are exchanged"):
            refuse_other_readings(
                sound.read_as(sound.force[:, order], sound.moment), TOOL.R_flange_sensor, self.LEVER
            )
