"""The catalogue: sourced numbers, kinematics by an independent solver, honest about gaps."""

import math
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import numpy as np
import pinocchio as pin
import py_opw_kinematics as opw
import pytest

from elastocal.errors import RobotError, SchemaError
from elastocal.robot import catalogue
from elastocal.robot.catalogue import (
    CatalogueEntry,
    catalogue as table,
    show_robot,
    show_robots,
)
from elastocal.robot.catalogue.catalogue import LINKS
from support.urdfs import colliding_links

ALL = catalogue.names()
NAMES = tuple(name for name in ALL if catalogue.entry(name).maker == "KUKA")
TRANSPORT = np.radians([0.0, -90.0, 90.0, 0.0, 45.0, 0.0])
INCOMPLETE = {"KR 210 R3100 ultra", "KR 240 R3330", "KR 360 R2830", "KR 600 R2830"}
"""Robots whose wrist links have no mass of their own in the source."""
every_robot = pytest.mark.parametrize("name", NAMES)


def opw_forward(entry: CatalogueEntry, q: np.ndarray) -> np.ndarray:
    """Return T_base_flange by the OPW convention: theta = sign * q - offset."""
    arm = entry.dimensions
    model = opw.KinematicModel(
        a1=arm.a1, a2=arm.a2, b=0.0, c1=arm.c1, c2=arm.c2, c3=arm.c3, c4=arm.c4
    )
    theta = np.array([-1, 1, 1, -1, 1, -1]) * q - np.radians([0, -90, 0, 0, 0, 0])
    return opw.Robot(model, degrees=False).forward(tuple(theta)).as_matrix()


class TestNames:
    def test_each_robot_is_shown_with_its_maker(self):
        listed, *_ = catalogue.show_robots(["UR20", "KR 300 R2700-2"])
        assert [row[:2] for row in listed.rows] == [
            ("UR20", "Universal Robots"),
            ("KR 300 R2700-2", "KUKA"),
        ]

    def test_all_robots_are_there(self):
        assert len(NAMES) == 17
        assert set(ALL) - set(NAMES) == {
            "IRB 6700-200/2.60",
            "R-2000iC/210F",
            "BXP135X",
            "BXP210L",
            "RX160",
            "UR10e",
            "UR20",
        }
        assert {"KR 120 R2700 extra HA", "KR 300 R2500 ultra", "KR 210 R3300-2 K"} <= set(NAMES)

    @pytest.mark.parametrize(
        "name", ["kr 120 r2700-2", "KR120R2700-2", "kr_120_r2700_2", "KR-120 R2700 2"]
    )
    def test_case_spaces_hyphens_and_underscores_do_not_matter(self, name):
        assert catalogue.entry(name).name == "KR 120 R2700-2"

    def test_no_two_names_are_the_same_to_a_lookup(self):
        assert all(catalogue.entry(name).name == name for name in ALL)

    def test_unknown_name_is_refused_with_the_nearest_and_where_all_are(self):
        with pytest.raises(RobotError, match="did you mean 'KR 120 R2700 extra HA'") as refusal:
            catalogue.load("KR 120 R2700 extra")
        assert "\n" not in str(refusal.value)
        assert sum(name in str(refusal.value) for name in ALL) <= 4
        assert str(refusal.value).endswith(
            "(`elastocal robots` lists them; any other robot is given as a URDF file)"
        )

    @pytest.mark.parametrize(
        ("name", "meant"),
        [
            ("KR 300", ["KR 300 R2500 ultra", "KR 300 R2700-2"]),
            ("kr500", ["KR 500 R2800-2"]),
            ("R3330", ["KR 240 R3330"]),
            ("universal robots", ["UR10e", "UR20"]),
            ("staubli", ["RX160"]),
            ("TX2-90", ["RX160"]),
        ],
    )
    def test_part_of_a_name_or_a_maker_suggests_all_that_it_may_mean(self, name, meant):
        with pytest.raises(RobotError) as refusal:
            catalogue.load(name)
        suggested = [robot for robot in ALL if repr(robot) in str(refusal.value)]
        assert suggested == meant

    def test_a_name_like_none_is_refused_without_the_whole_table(self):
        with pytest.raises(RobotError) as refusal:
            catalogue.load("KR 999")
        assert str(refusal.value) == (
            "no robot 'KR 999' in the catalogue (`elastocal robots` lists them; any other robot"
            " is given as a URDF file)"
        )

    def test_unknown_tip_is_refused_with_the_links(self):
        with pytest.raises(RobotError, match=r"no tip link 'flnage'; did you mean 'flange'"):
            catalogue.load("KR 120 R2700-2", tip="flnage")


class TestKinematics:
    @every_robot
    def test_forward_kinematics_agree_with_opw(self, name):
        robot, entry = catalogue.load(name), catalogue.entry(name)
        rng = np.random.default_rng(7)
        for q in rng.uniform(robot.limits.lower, robot.limits.upper, (20, 6)):
            assert np.abs(robot.forward(q) - opw_forward(entry, q)).max() < 1e-9

    @every_robot
    def test_zero_pose_is_the_arm_stretched_forward(self, name):
        arm = catalogue.entry(name).dimensions
        T = catalogue.load(name).forward(np.zeros(6))
        reach = arm.a1 + arm.c2 + arm.c3 + arm.c4
        np.testing.assert_allclose(T[:3, 3], [reach, 0.0, arm.c1 - arm.a2], atol=1e-12)
        np.testing.assert_allclose(T[:3, 2], [1.0, 0.0, 0.0], atol=1e-12)

    def test_positive_a1_turns_clockwise_seen_from_above(self):
        robot = catalogue.load("KR 120 R2700-2")
        assert robot.forward(np.radians([30.0, 0, 0, 0, 0, 0]))[1, 3] < 0.0

    def test_positive_a2_lowers_the_arm(self):
        robot = catalogue.load("KR 120 R2700-2")
        raised = robot.forward(np.radians([0.0, -60.0, 0, 0, 0, 0]))[2, 3]
        assert robot.forward(np.radians([0.0, -30.0, 0, 0, 0, 0]))[2, 3] < raised

    @pytest.mark.parametrize(
        ("name", "a2"), [("KR 210 R2700 extra", 0.041), ("KR 210 R2700-2", -0.115)]
    )
    def test_forearm_lies_below_a3_in_one_generation_and_above_in_the_next(self, name, a2):
        arm = catalogue.entry(name).dimensions
        drop = arm.c1 - catalogue.load(name).forward(np.zeros(6))[2, 3]
        assert drop == pytest.approx(a2, abs=1e-12)

    @every_robot
    def test_reach_is_that_of_the_name_and_of_the_maker(self, name):
        entry = catalogue.entry(name)
        in_name = float(name.split(" R")[1][:4]) / 1000.0
        assert entry.reach == pytest.approx(in_name, abs=7e-3)
        if entry.dimensions.published_reach is not None:
            assert entry.reach == pytest.approx(entry.dimensions.published_reach, abs=5e-4)

    def test_reaches_of_both_robots_of_the_paper_are_published(self):
        for name in ("KR 120 R2700 extra HA", "KR 300 R2500 ultra"):
            assert catalogue.entry(name).dimensions.published_reach is not None

    @every_robot
    def test_reach_is_where_the_wrist_gets_to(self, name):
        entry, robot = catalogue.entry(name), catalogue.load(name)
        arm, a2 = entry.dimensions, np.clip(0.0, robot.limits.lower[1], robot.limits.upper[1])
        a3 = math.atan2(-arm.a2, arm.c3) - a2
        T = robot.forward([0.0, a2, a3, 0.0, 0.0, 0.0])
        wrist = T[:3, 3] - arm.c4 * T[:3, 2]
        assert wrist[0] == pytest.approx(entry.reach, abs=1e-12)


class TestLimits:
    @every_robot
    def test_urdf_carries_the_tables_numbers_in_si(self, name):
        entry, limits = catalogue.entry(name), catalogue.load(name).limits
        np.testing.assert_allclose(np.degrees(limits.lower), entry.position.lower, rtol=1e-14)
        np.testing.assert_allclose(np.degrees(limits.upper), entry.position.upper, rtol=1e-14)
        if entry.velocity.maximum is not None:
            np.testing.assert_allclose(np.degrees(limits.velocity), entry.velocity.maximum)
        if entry.effort.maximum is not None:
            np.testing.assert_array_equal(limits.effort, entry.effort.maximum)

    @every_robot
    def test_unknown_maxima_are_nan_and_marked(self, name):
        robot = catalogue.load(name)
        marked = {assumption.field for assumption in robot.assumptions}
        for field in ("velocity", "effort"):
            unknown = np.isnan(getattr(robot.limits, field))
            assert unknown.all() or not unknown.any()
            assert unknown.all() == (field in marked)

    def test_speeds_and_torques_of_the_papers_robots_are_not_invented(self):
        for name in ("KR 120 R2700 extra HA", "KR 300 R2500 ultra"):
            limits = catalogue.load(name).limits
            assert np.isnan([*limits.velocity, *limits.effort]).all()

    def test_borrowed_position_limits_are_marked(self):
        robot = catalogue.load("KR 300 R2500 ultra")
        reasons = {assumption.field: assumption.reason for assumption in robot.assumptions}
        assert "KR 210 R3100 ultra" in reasons["position"]

    @every_robot
    def test_transport_pose_is_within_the_limits(self, name):
        assert (catalogue.load(name).limits.margin(TRANSPORT) > 0.0).all()


class TestSources:
    @every_robot
    def test_every_group_has_a_source_or_is_marked(self, name):
        robot, entry = catalogue.load(name), catalogue.entry(name)
        marked = {assumption.field: assumption.reason for assumption in robot.assumptions}
        assert len(marked) == len(robot.assumptions)
        assert set(entry.groups) <= set(entry.sources) | set(marked)
        assert marked == entry.assumptions | {"shape": marked["shape"]}
        assert all(len(reason) > 20 for reason in marked.values())

    @every_robot
    def test_comments_of_the_urdf_name_the_sources(self, name):
        header = catalogue.urdf(name).split("-->")[0]
        assert all(source in header for source in catalogue.entry(name).sources.values())

    @every_robot
    def test_parsers_find_nothing_to_complain_about(self, name, capfd):
        pin.buildModelFromXML(catalogue.urdf(name))
        assert capfd.readouterr() == ("", "")


class TestMasses:
    @every_robot
    def test_quantec_weighs_about_a_tonne_and_fortec_about_two(self, name):
        entry = catalogue.entry(name)
        mass = sum(link.mass for link in entry.inertia.links.values())
        fortec = entry.dimensions.a1 == 0.5
        assert (1600.0 if fortec else 1000.0) < mass < (2500.0 if fortec else 1300.0)

    @pytest.mark.parametrize("name", sorted(set(NAMES) - INCOMPLETE))
    def test_inertias_are_physically_possible(self, name):
        entry = catalogue.entry(name)
        for link in entry.inertia.links.values():
            xx, yy, zz, xy, xz, yz = link.tensor
            moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            assert moments[0] > 0.0
            assert moments[0] + moments[1] > 0.999 * moments[2]

    @pytest.mark.parametrize("name", sorted(INCOMPLETE))
    def test_inertias_that_the_source_leaves_out_are_marked(self, name):
        assert "lumped" in catalogue.entry(name).assumptions["inertia"]

    @every_robot
    def test_a2_carries_kilonewton_metres_but_a1_nothing_on_a_level_floor(self, name):
        torque = catalogue.load(name).gravity_torques(np.radians([20.0, -10, 10, 0, 0, 0]))
        assert torque[0] == pytest.approx(0.0, abs=1e-9)
        assert 4e3 < -torque[1] < 2.5e4

    def test_estimated_masses_move_with_the_lengths(self):
        short = catalogue.entry("KR 300 R2500 ultra").inertia.links
        long = catalogue.entry("KR 300 R2700-2").inertia.links
        assert short["link_3"].mass == long["link_3"].mass
        ratio = short["link_3"].centre[0] / long["link_3"].centre[0]
        assert ratio == pytest.approx(1.0 / 1.22)


class TestShapes:
    @every_robot
    def test_every_link_has_the_same_shapes_to_see_and_to_hit(self, name):
        for link in ElementTree.fromstring(catalogue.urdf(name)).findall("link"):
            seen, hit = (
                [[part.attrib for part in shape.iter()] for shape in link.findall(kind)]
                for kind in ("visual", "collision")
            )
            assert seen == hit
            assert bool(hit) == (link.get("name") in LINKS)

    @every_robot
    def test_links_that_are_not_neighbours_keep_clear(self, name):
        robot = catalogue.load(name)
        at_transport = TRANSPORT.copy()
        for a5 in (TRANSPORT[4], robot.limits.lower[4], robot.limits.upper[4]):
            at_transport[4] = a5
            assert colliding_links(catalogue.urdf(name), at_transport) == []

    def test_hand_folded_back_under_the_arm_hits_the_column(self):
        urdf = catalogue.urdf("KR 120 R2700-2")
        assert colliding_links(urdf, np.radians([0.0, -10.0, 165.0, 0.0, 0.0, 0.0])) != []


def small_table() -> dict:
    """Return the data of a table with one robot, complete and consistent."""
    arm = {"source": "s", "a1": 0.3, "a2": 0.0, "c1": 0.6, "c2": 1.0, "c3": 1.0, "c4": 0.2}
    robot = {
        "name": "A",
        "dimensions": arm,
        "position": {"source": "s", "lower": [-1] * 6, "upper": [1] * 6},
        "velocity": {"source": "s", "maximum": [1] * 6},
        "effort": {"assumption": "unknown"},
        "inertia": {
            "source": "s",
            "links": {
                link: {"mass": 1.0, "centre": [0, 0, 0], "tensor": [1, 1, 1, 0, 0, 0]}
                for link in LINKS
            },
        },
    }
    return {"schema": table.SCHEMA, "robots": [robot]}


def read(data: dict) -> dict[str, CatalogueEntry]:
    return table.read_table(data, "t.yaml")


class TestTable:
    def test_group_without_source_is_an_assumption(self):
        entry = read(small_table())["A"]
        assert tuple(entry.sources) == ("dimension", "position", "velocity", "inertia")
        assert entry.assumptions == {"effort": "unknown"}

    def test_another_schema_is_refused(self):
        with pytest.raises(SchemaError, match=r"t\.yaml has schema 'x/9'"):
            read(small_table() | {"schema": "x/9"})

    def test_two_robots_of_one_name_are_refused(self):
        data = small_table()
        with pytest.raises(SchemaError, match="two robots have the same name"):
            read(data | {"robots": data["robots"] * 2})

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            (lambda robot: robot["dimensions"].pop("source"), "source or an assumption"),
            (lambda robot: robot["velocity"].pop("maximum"), "not known need an assumption"),
            (lambda robot: robot["position"]["lower"].pop(), "position.lower"),
            (lambda robot: robot["dimensions"].update(c2=math.nan), "dimensions.c2"),
            (lambda robot: robot["inertia"]["links"].pop("link_6"), "in this order"),
            (lambda robot: robot.update(inertia={"like": "B"}), "is like 'B'"),
            (lambda robot: robot.update(payload=120), "unknown key 'payload'"),
        ],
    )
    def test_broken_robot_is_refused_by_name(self, change, message):
        data = small_table()
        change(data["robots"][0])
        with pytest.raises(SchemaError, match=message) as refusal:
            read(data)
        assert str(refusal.value).startswith("t.yaml: ")


def test_a_robot_is_read_from_a_file_that_is_named_by_a_text(tmp_path):
    from elastocal.robot import Robot, catalogue

    file = tmp_path / "robot.urdf"
    file.write_text(catalogue.urdf("KR 120 R2700 extra HA"), encoding="utf-8")
    assert Robot.from_file(str(file), "flange").tip == "flange"


def test_what_is_shown_of_a_robot_has_its_numbers_and_their_sources():
    name = "UR20"
    (table, paragraph) = show_robots([name])
    assert [row[0] for row in table.rows] == [name]
    assert "not known" in str(paragraph.text)
    joints, facts = show_robot(name)
    robot, known = catalogue.load(name), catalogue.entry(name)
    assert [row[0] for row in joints.rows] == list(robot.joint_names)
    assert f"{np.degrees(robot.limits.upper[0]):.1f}" in joints.rows[0][2]
    assert {f"source of {field}" for field in known.sources} <= {fact for fact, _ in facts.pairs}


def test_the_catalogue_is_there_without_an_import_of_its_own():
    code = "import elastocal as ec; print(ec.robot.catalogue.load('BXP210L').name)"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout == "BXP210L\n"
