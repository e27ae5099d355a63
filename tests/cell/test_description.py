"""The cell file: what it says, and what it refuses, by its path in the file."""

import copy
import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from elastocal.cell import load_cell
from elastocal.cell.examples import write_example
from elastocal.errors import FileAccessError, SchemaError
from elastocal.robot import catalogue


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("cell")
    write_example(folder, "afp")
    return folder


@pytest.fixture(scope="module")
def example(folder) -> dict:
    return yaml.safe_load((folder / "cell.yaml").read_text())


def load(folder, data):
    path = folder / "changed.yaml"
    path.write_text(yaml.safe_dump(data))
    return load_cell(path)


def changed(example, key, value):
    """The example with one value, given by its path, put in; None takes it out."""
    data = copy.deepcopy(example)
    *parents, last = [int(part) if part.isdigit() else part for part in key.split(".")]
    inner = data
    for parent in parents:
        inner = inner.setdefault(parent, {}) if isinstance(inner, dict) else inner[parent]
    if value is None:
        del inner[last]
    else:
        inner[last] = value
    return data


def refusal(folder, data, error=SchemaError) -> str:
    with pytest.raises(error) as caught:
        load(folder, data)
    assert "\n" not in str(caught.value)
    assert "changed.yaml" in str(caught.value)
    return str(caught.value)


def test_quantities_arrive_in_si(folder):
    cell = load_cell(folder / "cell.yaml")
    file = cell.file
    assert file.engagement.disk_radius == pytest.approx(0.025)
    assert file.limits.wrist_angle == pytest.approx(math.radians(10))
    np.testing.assert_allclose(cell.T_flange_tcp[:3, 3], (0.06, 0, 0.45))
    np.testing.assert_allclose(cell.tool_centre_tcp, (-0.06, 0, -0.27))
    np.testing.assert_allclose(cell.T_sensor_tcp[:3, 3], (0.06, 0, 0.42))
    np.testing.assert_allclose(np.linalg.norm(file.marker.axis_tcp), 1.0)
    np.testing.assert_allclose(file.sensor.largest_moment, 400.0)
    assert cell.surface_path == folder / "dome.stl"


def test_load_cases_are_forces_on_the_robot_in_the_tcp_frame(folder):
    np.testing.assert_array_equal(
        load_cell(folder / "cell.yaml").file.load_cases.force_tcp,
        [[0, 0, -1100], [280, 0, -1100], [-280, 0, -1100], [0, -280, -1100], [0, 280, -1100]],
    )


def test_the_rail_comes_first_and_its_frame_is_the_base(folder):
    cell = load_cell(folder / "cell.yaml")
    assert cell.robot.joint_names[0] == "rail"
    assert cell.robot.base == "rail_base"
    bare = catalogue.load("KR 120 R2700 extra HA")
    q = np.radians([10, -80, 90, 20, 40, 5])
    expected = bare.forward(q) @ cell.T_flange_tcp
    expected[:3, 3] += (0, 0.7, 0.4)
    np.testing.assert_allclose(cell.robot.forward([0.7, *q]), expected, atol=1e-12)


def test_a_searched_rail_is_tried_every_quarter_metre_and_not_at_its_ends(folder):
    positions = load_cell(folder / "cell.yaml").external_positions
    np.testing.assert_allclose(positions, np.linspace(-1.499, 1.499, 13)[:, None])


def test_a_searched_rail_keeps_its_margin(folder, example):
    cell = load(folder, changed(example, "limits.rail_margin", "50 mm"))
    margin = np.minimum(cell.external_positions + 1.5, 1.5 - cell.external_positions) - 0.05
    assert margin.min() == pytest.approx(1e-3)


def test_a_margin_that_leaves_almost_nothing_still_leaves_places(folder, example):
    cell = load(folder, changed(example, "limits.rail_margin", "1499.9 mm"))
    assert len(cell.external_positions)
    assert np.abs(cell.external_positions).max() < 1e-4


@pytest.mark.parametrize(
    ("margin", "position", "words"),
    [
        ("0 mm", "1.5 m", "1.5 m must be above -1500 mm and below 1500 mm"),
        ("50 mm", "-1450 mm", "-1450 mm must be above -1450 mm and below 1450 mm"),
        ("50 mm", "1.46 m", "its limits less limits.rail_margin of 50 mm"),
    ],
)
def test_a_listed_position_where_no_pose_can_be_is_refused(
    folder, example, margin, position, words
):
    data = changed(example, "limits.rail_margin", margin)
    data = changed(data, "robot.external.rail", ["0 m", position])
    message = refusal(folder, data)
    assert words in message
    assert "robot: external.rail" in message


def test_more_combinations_than_can_be_tried_are_refused_with_their_number(folder, example):
    data = changed(example, "robot.rail.travel", ["-125 m", "125 m"])
    message = refusal(folder, data)
    assert "1001 of rail are 1001 combinations of positions, at most 500" in message
    assert "wrong unit" in message
    data = changed(example, "robot.external.rail", [f"{i} mm" for i in range(501)])
    assert "501 combinations" in refusal(folder, data)
    data = changed(example, "robot.external.rail", [f"{i} mm" for i in range(500)])
    assert len(load(folder, data).external_positions) == 500


def test_given_rail_positions_are_taken(folder, example):
    data = changed(example, "robot.external.rail", ["-500 mm", "0.5 m"])
    np.testing.assert_allclose(load(folder, data).external_positions, [[-0.5], [0.5]])


def test_torques_are_the_figures_times_the_factor_and_unknown_for_the_rest(folder, example):
    torques = load_cell(folder / "cell.yaml").torque_limits
    np.testing.assert_allclose(torques[1:3], [0.8 * 7290, 0.8 * 8910])
    assert np.isnan(torques[0])
    bare = load(folder, changed(example, "limits.torque", {"factor": 0.5}))
    assert np.isnan(bare.torque_limits).all()  # the catalogue has none for this robot


def test_gravity_turns_with_the_mounting(folder, example):
    data = changed(example, "robot.mounting", {"abc": ["0 deg", "0 deg", "180 deg"]})
    np.testing.assert_allclose(load(folder, data).gravity_base, (0, 0, 9.80665), atol=1e-12)


def test_margins_are_in_the_unit_of_each_joint(folder, example):
    data = changed(example, "limits.rail_margin", "50 mm")
    margin = load(folder, data).joint_margin
    np.testing.assert_allclose(margin, [0.05, *[math.radians(5)] * 6])


def test_a_urdf_beside_the_cell_file_is_found(folder, example):
    (folder / "arm.urdf").write_text(catalogue.urdf("KR 210 R2700-2"))
    data = changed(changed(example, "robot.model", None), "robot.urdf", "arm.urdf")
    assert load(folder, data).robot.name == "KR 210 R2700-2"


def test_process_poses_are_read(folder, example):
    data = changed(example, "process", {"file": "process.csv"})
    assert "process.file" in refusal(folder, data, FileAccessError)
    joints = [f"joint_a{i}[deg]" for i in range(1, 7)]
    header = ["rail[m]", *joints, "force_x[N]", "force_y[N]", "force_z[N]"]
    (folder / "process.csv").write_text(",".join(header) + "\n0.5,0,-90,90,0,45,0,1,2,3\n")
    rows = load(folder, data).process
    np.testing.assert_allclose(rows.joint_position[0, :3], (0.5, 0, -np.pi / 2))
    np.testing.assert_allclose(rows.force, [[1, 2, 3]])


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("engagement.disk_radius", 25, "engagement.disk_radius: 25 is not a length"),
        ("engagement.disk_radius", "25", "not a length"),
        ("engagement.disk_radius", "25 N", "unit 'N' is not a length"),
        ("engagement.disk_radius", "0 mm", "greater than 0"),
        ("engagement.approach_distance", "2 mm", "must be above near_contact"),
        ("engagement.disk_radios", "25 mm", "'engagement.disk_radios'; did you mean 'disk_radius'"),
        ("trackers.0.positon", ["0 m"] * 3, "did you mean 'position'"),
        ("robot.modell", "x", "unknown key 'robot.modell'; did you mean 'model'"),
        ("gadgets", {}, "unknown key 'gadgets'"),
        ("load_cases.friction", 0, "load_cases.friction: Input should be greater than 0"),
        ("load_cases.friction", float("nan"), "finite number"),
        ("load_cases.safety", 0.9, "load_cases.safety: Input should be greater than or equal to 1"),
        ("load_cases.fz", "0 N", "load_cases.fz: Input should be greater than 0"),
        ("load_cases.fx", "0 N", "north and south need fx above 0"),
        ("load_cases.fx", "1e999 N", "not a finite force"),
        ("load_cases.cases", [], "at least one load case"),
        ("load_cases.cases", ["normal", "normal"], "named twice"),
        ("load_cases.cases", ["nord"], "'normal', 'north', 'south', 'east' or 'west'"),
        ("search.d_max", "0 mm", "search.d_max: Input should be greater than 0"),
        ("search.d_max", "-175 mm", "greater than 0"),
        ("search.poses", 0, "search.poses: Input should be greater than or equal to 1"),
        ("search.poses", 4000, "search.pool: must be at least the 4000 poses"),
        ("trackers.0.range", ["15 m", "1 m"], "trackers.0.range: the first must be"),
        ("robot.rail.travel", ["1 m", "-1 m"], "robot.rail.travel: the first must be"),
        ("robot.rail.axis", [0, 0, 0], "must be a direction"),
        ("robot.external.rial", "search", "no external axis 'rial'; did you mean 'rail'"),
        ("robot.external.rail", ["2 m"], "external.rail: 2 m must be above -1500 mm and below 15"),
        ("robot.external.rail", ["2 deg"], "not a length"),
        ("robot.external.rail", [], "at least one position"),
        ("robot.model", "KR 120 R2700 extra XA", "did you mean 'KR 120 R2700 extra HA'"),
        ("robot.model", None, "exactly one of model, urdf is needed; there is none"),
        ("robot.urdf", "arm.urdf", "there is model and urdf"),
        (
            "robot.flange",
            "flansch",
            "no link 'flansch': write the link that carries the tool",
        ),
        ("limits.payload", "50 kg", "payload 50 kg is below the tool's mass, 60 kg"),
        ("limits.torque.factor", 1.5, "limits.torque.factor: Input should be less than or equal"),
        ("limits.torque.provenance", None, "say where the torque values are from"),
        ("limits.torque.values.joint_a7", "1 N*m", "no joint 'joint_a7'"),
        ("limits.torque.values.joint_a1", "0 N*m", "joint_a1 must be above 0"),
        ("limits.torque.values.joint_a2", "8 kN", "joint_a2 turns and has a moment: unit 'kN'"),
        ("limits.torque.values.rail", "8 kN*m", "rail slides and has a force: unit 'kN*m'"),
        ("load_cases.friction", True, "load_cases.friction: must be a number, got True"),
        ("robot.rail.axis", [False, True, False], "robot.rail.axis: must be a number"),
        ("search.pool", 10_000_001, "search.pool: Input should be less than or equal to 10000000"),
        ("search.seed", 2**64, "search.seed: Input should be less"),
        ("search.poses", "15 kg", "should be a valid integer, without a unit or quotes, got '15"),
        ("load_cases.level", "120 kg", "valid number, without a unit or quotes, got '120 kg'"),
        ("engagement.disk_radius", "1001 m", "engagement.disk_radius: '1001 m' is too large"),
        ("tcp.abc.0", "1e300 deg", "tcp.abc.0: '1e300 deg' is too large"),
        ("motion.home.rail", "1e300 m", "home.rail: '1e300 m' is too large"),
        ("motion.contact_speed", "1e-300 m/s", "motion.contact_speed: '1e-300 m/s' is too small"),
        ("marker.axis", [1e-300, 0, 0], "must be a direction"),
        ("fixtures.0.name", "tooling", "fixtures: the name 'tooling' is the surface's"),
        ("limits.joint_margin", "-1 deg", "limits.joint_margin: Input should be greater than"),
        ("limits.wrist_angle", "100 deg", "should be less than 90 deg, got '100 deg'"),
        ("limits.wrist_angle", "90 deg", "limits.wrist_angle: Input should be less than 90 deg"),
        ("limits.wrist_angle", "1.6 rad", "should be less than 1.5708 rad, got '1.6 rad'"),
        ("limits.joint_margin", "190 deg", "less than or equal to 180 deg, got '190 deg'"),
        ("marker.acceptance", "190 deg", "less than or equal to 180 deg, got '190 deg'"),
        ("procedure.contact_speed", "25 mm/s", "less than or equal to 20 mm/s, got '25 mm/s'"),
        ("marker", None, "trackers need a marker"),
        ("surface.unit", "inch", "unit 'inch' is not a length"),
        ("surface.region", {}, "exactly one of box, polygon"),
        ("tool.shapes.0", {"name": "x"}, "exactly one of box, cylinder, sphere, mesh"),
        ("tool.shapes.0.cylinder.radius", "0 mm", "tool.shapes.0.cylinder.radius"),
        ("tool", None, "key 'tool' is missing"),
        ("schema", "elastocal.cell/2", "this version reads 'elastocal.cell/1'"),
    ],
)
def test_what_does_not_fit_is_refused_by_its_path(folder, example, key, value, words):
    assert words in refusal(folder, changed(example, key, value))


def test_a_misspelt_section_is_named_not_what_misses_it(folder, example):
    data = {("markr" if key == "marker" else key): value for key, value in example.items()}
    assert "unknown key 'markr'; did you mean 'marker'?" in refusal(folder, data)


def test_two_stations_of_one_name_are_refused(folder, example):
    data = changed(example, "trackers", 2 * example["trackers"])
    assert "2 stations are named 'station_1'" in refusal(folder, data)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("surface.file", "absent.stl"),
        ("fixtures.0", {"mesh": {"file": "absent.stl", "unit": "mm"}}),
        ("tool.shapes.1", {"mesh": {"file": "absent.stl", "unit": "mm"}}),
    ],
)
def test_a_mesh_that_is_not_there_is_refused(folder, example, key, value):
    message = refusal(folder, changed(example, key, value), FileAccessError)
    assert "absent.stl" in message
    assert key.rsplit(".", 1)[0].split(".")[0] in message


def test_the_region_corners_have_to_be_in_order(folder, example):
    box = {"min": ["0 m", "0 m", "0 m"], "max": ["1 m", "0 m", "1 m"]}
    assert "above that of min" in refusal(folder, changed(example, "surface.region", {"box": box}))
    line = {"corners": [["0 m", "0 m"], ["1 m", "1 m"], ["2 m", "2 m"]]}
    data = changed(example, "surface.region", {"polygon": line})
    assert "encloses no area" in refusal(folder, data)
