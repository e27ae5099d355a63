"""Robots of other makers: zeros, signs and lengths as their makers have them, checked by others."""

import math

import numpy as np
import pinocchio as pin
import py_opw_kinematics as opw
import pytest

from elastocal.robot import catalogue
from elastocal.robot.catalogue import maker_of
from elastocal.robot.catalogue.catalogue import LINKS
from elastocal.robot.inverse import inverse_for
from elastocal.robot.inverse.numerical import NumericalInverse, ParallelInverse
from elastocal.robot.inverse.opw import OpwInverse
from support.urdfs import colliding_links

OTHERS = ("IRB 6700-200/2.60", "R-2000iC/210F", "BXP210L", "RX160", "UR10e", "UR20")
WRISTED = OTHERS[:4]
PARALLEL = OTHERS[4:]
REACH = dict(zip(OTHERS, (2.60, 2.655, 2.597, 1.60, 1.184, 1.591), strict=True))
FLANGES = {
    "IRB 6700-200/2.60": ((1.6625, 0.0, 2.105), (0, 0, -1), (1, 0, 0)),
    "R-2000iC/210F": ((1.807, 0.0, 1.97), (0, 0, 1), (1, 0, 0)),
    "BXP210L": ((0.0, 1.675, 1.92), (1, 0, 0), (0, 1, 0)),
    "RX160": ((0.15, 0.0, 2.11), (1, 0, 0), (0, 0, 1)),
}
"""At zero: place of the flange by adding up the source's origins; where its x and its z point."""
SIGNS = {
    "IRB 6700-200/2.60": [1, 1, 1, 1, 1, 1],
    "R-2000iC/210F": [1, 1, -1, -1, -1, -1],
    "BXP210L": [-1, 1, -1, 1, -1, 1],
    "RX160": [1, 1, 1, 1, 1, 1],
}
DH = {
    "UR10e": ((0.1807, 0.17415, 0.11985, 0.11655), (-0.6127, -0.57155)),
    "UR20": ((0.2363, 0.201, 0.1593, 0.1543), (-0.862, -0.7287)),
}
"""d1, d4, d5, d6 and a2, a3 of Universal Robots' table, in m."""


def denavit_hartenberg(name: str, q: np.ndarray) -> np.ndarray:
    """Return the flange of a UR by its maker's table, link by link."""
    (d1, d4, d5, d6), (a2, a3) = DH[name]
    rows = zip((d1, 0, 0, d4, d5, d6), (0, a2, a3, 0, 0, 0), (90, 0, 0, 90, -90, 0), q, strict=True)
    T = np.eye(4)
    for d, a, alpha, theta in rows:
        c, s = math.cos(theta), math.sin(theta)
        ca, sa = round(math.cos(math.radians(alpha))), round(math.sin(math.radians(alpha)))
        T = T @ np.array(
            [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
        )
    return T


@pytest.mark.parametrize("name", PARALLEL)
def test_a_ur_is_its_makers_denavit_hartenberg_table(name):
    robot = catalogue.load(name)
    for q in np.random.default_rng(3).uniform(-3, 3, (20, 6)):
        np.testing.assert_allclose(robot.forward(q), denavit_hartenberg(name, q), atol=1e-12)


@pytest.mark.parametrize("name", WRISTED)
def test_at_zero_the_flange_is_where_the_source_has_it(name):
    place, x, z = FLANGES[name]
    T = catalogue.load(name).forward(np.zeros(6))
    np.testing.assert_allclose(T[:3, 3], place, atol=1e-12)
    np.testing.assert_allclose(T[:3, [0, 2]].T, [x, z], atol=1e-12)


@pytest.mark.parametrize("name", WRISTED)
def test_kinematics_are_those_of_an_independent_solver(name):
    """OPW: the arm straight up at zero, axes 2, 3 and 5 about y."""
    arm = catalogue.entry(name).dimensions
    model = opw.KinematicModel(
        a1=arm.a1, a2=arm.a2, b=0.0, c1=arm.c1, c2=arm.c2, c3=arm.c3, c4=arm.c4
    )
    bend = np.radians([0, 0, 0 if name == "RX160" else 90, 0, 0, 0])
    solver, robot = opw.Robot(model, degrees=False), catalogue.load(name)
    turn = {
        "R-2000iC/210F": np.diag([-1.0, -1.0, 1.0]),
        "BXP210L": np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    }.get(name, np.eye(3))
    # At zero a Kawasaki points along y.
    forward = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    base = forward if name == "BXP210L" else np.eye(3)
    for q in np.random.default_rng(5).uniform(-1, 1, (20, 6)):
        T = solver.forward(tuple(np.array(SIGNS[name]) * q + bend)).as_matrix()
        reached = robot.forward(q)
        np.testing.assert_allclose(reached[:3, 3], base @ T[:3, 3], atol=1e-9)
        np.testing.assert_allclose(reached[:3, :3], base @ T[:3, :3] @ turn, atol=1e-9)


@pytest.mark.parametrize(("name", "reach"), [*REACH.items()])
def test_reach_is_that_of_the_maker(name, reach):
    assert catalogue.entry(name).reach == pytest.approx(reach, abs=1e-3)


@pytest.mark.parametrize("name", OTHERS)
class TestEveryOther:
    def test_every_group_has_a_source_or_is_marked(self, name):
        entry = catalogue.entry(name)
        marked = {each.field: each.reason for each in catalogue.load(name).assumptions}
        assert set(entry.groups) <= set(entry.sources) | set(marked)
        assert {"dimension", "position", "velocity"} <= set(entry.sources)

    def test_torques_say_that_nobody_stated_them_as_continuous_or_are_unknown(self, name):
        entry = catalogue.entry(name)
        said = entry.sources.get("effort", "") + entry.assumptions.get("effort", "")
        assert "unknown" in said or "not stated" in said
        assert np.isnan(catalogue.load(name).limits.effort).all() == ("effort" in entry.assumptions)

    def test_limits_and_speeds_are_the_tables_in_si(self, name):
        entry, limits = catalogue.entry(name), catalogue.load(name).limits
        np.testing.assert_allclose(np.degrees(limits.lower), entry.position.lower, rtol=1e-14)
        np.testing.assert_allclose(np.degrees(limits.velocity), entry.velocity.maximum)

    def test_inertias_are_physically_possible(self, name):
        for link in LINKS[1:]:
            xx, yy, zz, xy, xz, yz = catalogue.entry(name).inertia.links[link].tensor
            moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            assert moments[0] > 0.0
            assert moments[0] + moments[1] > 0.99 * moments[2]

    def test_parsers_find_nothing_to_complain_about(self, name, capfd):
        pin.buildModelFromXML(catalogue.urdf(name))
        assert capfd.readouterr() == ("", "")

    def test_links_that_are_not_neighbours_keep_clear_when_the_elbow_is_bent(self, name):
        bent = {"RX160": [0, 40, 90, 0, 40, 0]}.get(name, [0, -20, 20, 0, 60, 0])
        q = np.radians([0, -110, 110, -90, -90, 0] if name in PARALLEL else bent)
        assert colliding_links(catalogue.urdf(name), q) == []

    def test_the_inverse_is_in_closed_form_and_finds_what_the_numerical_one_finds(self, name):
        robot = catalogue.load(name)
        solver = inverse_for(robot)
        assert type(solver) is (ParallelInverse if name in PARALLEL else OpwInverse)
        T = robot.forward([0.3, -1.0, 1.2, 0.4, 0.9, 0.2])
        ours = solver.solve(T)
        for q in NumericalInverse(robot).solve(T):
            assert np.abs(ours - q).max(axis=1).min() < 1e-7


def test_a_straight_ur_wrist_has_a_defined_answer():
    robot = catalogue.load("UR20")
    q = np.array([0.3, -1.2, 1.1, 0.4, 0.0, 0.2])
    found = inverse_for(robot).solve(robot.forward(q))
    straight = found[np.abs(found[:, 4]) < 1e-9]
    assert len(straight)
    assert np.all(straight[:, 5] == 0.0)


@pytest.mark.parametrize(
    ("name", "maker"),
    [
        ("kuka_kr210", "KUKA"),
        ("abb_irb4600_40_255", "ABB"),
        ("fanuc_m900ib700", "FANUC"),
        ("ur5e_robot", "Universal Robots"),
        ("staubli_tx2_90", "Staeubli"),
        ("bxp135x-a001", "Kawasaki"),
        ("khi_rs080n", "Kawasaki"),
        ("irb 6700-200/2.60", "ABB"),
        ("arm", None),
        ("figure_urban", None),
    ],
)
def test_the_maker_is_known_by_the_name(name, maker):
    assert maker_of(name) == maker
