"""How often the interval of each spring holds the spring that was planted.

The truth is an arm of `elastocal.sim.arm` at its exact loaded equilibrium, under its own weight if
it has masses: a gear and two tilts at each joint, of sizes drawn anew in each campaign, which the
ladder's `bearing` can express. In half of the campaigns three tilts of four are rigid: beside a
spring that a bound holds at zero, draws are too sure of the others
(docs/decisions/0156-profiles-of-springs.md). What `calibrate --springs auto` calls known is held
against the spring of the same name, in few and in many poses. Light arms are pressed as far as some
2 mm: at 5 mm their levers are no longer those of the fit (docs/decisions/0135-known-by-name.md).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from elastocal.elastic.layouts import joint_origins
from elastocal.identification import (
    FitOptions,
    calibrate,
    choose_model,
    spring_summaries,
    sum_summaries,
    with_knowledge,
)
from elastocal.identification.figures import SpringSummary
from elastocal.parallel import one_blas_thread
from elastocal.robot import Robot, T_from_xyzabc, catalogue, with_tool
from elastocal.sim.arm import (
    Linear,
    Linkage,
    Noise,
    TruthSpring,
    axial_spring,
    measure,
    press_forces,
)
from elastocal.sim.arm.elastic_arm import GRAVITY, ElasticArm
from support.measured_arms import seven_axes
from support.urdfs import opw_arm_urdf

CAMPAIGNS = 25
POSES = {"few": 7, "many": 31}
TILT = 0.05, 0.4
"""Compliance of a tilt over that of the gear of its joint."""
TILTING = 1.0, 0.25
"""Share of the tilts that are not rigid, in one half of the campaigns and in the other."""
GEAR = 0.7, 1.4
"""Compliance of a gear over the usual one of the arm."""


@dataclass(frozen=True)
class Kind:
    """A kind of arm, and how it is pressed."""

    urdf: str
    gears: tuple[float, ...]
    """Usual compliance of each gear, in µrad/(N·m)."""
    middle: tuple[float, ...]
    """Posture about which it presses, in rad."""
    press: float
    """Force along the tool, in N."""

    @property
    def robot(self) -> Robot:
        return Robot.from_urdf(self.urdf, "tool")


def _tooled(urdf: str, flange: str, size: float) -> str:
    T_flange_tool = T_from_xyzabc(0.15 * size, 0.0, size, 0.0, np.radians(20.0), 0.0)
    return with_tool(urdf, flange, "tool", T_flange_tool)


@cache
def kind(arm: str) -> Kind:
    """Return one of the four kinds."""
    if arm == "parallel axes":
        gears = 20.0, 20.0, 33.0, 100.0, 100.0, 100.0
        middle = 0.0, -1.2, 1.6, -1.9, -1.57, 0.0
        return Kind(_tooled(catalogue.urdf("UR10e"), "flange", 0.15), gears, middle, 60.0)
    if arm == "210 kg":
        gears = 0.42, 0.35, 0.39, 1.3, 1.7, 3.3
        middle = 0.0, -1.75, 1.9, 0.0, 1.0, 0.0
        return Kind(_tooled(catalogue.urdf("KR 210 R2700-2"), "flange", 0.3), gears, middle, 1100.0)
    if arm == "seven axes":
        gears = 67.0, 67.0, 83.0, 83.0, 100.0, 125.0, 170.0
        middle = 0.0, 0.6, 0.3, 1.6, 0.2, 0.9, 0.0
        return Kind(_tooled(seven_axes().urdf, "tcp", 0.15), gears, middle, 40.0)
    small = opw_arm_urdf(0.0, -0.07, 0.0, 0.29, 0.27, 0.302, 0.072, name="3 kg")
    gears = 25.0, 30.0, 40.0, 120.0, 150.0, 250.0
    return Kind(_tooled(small, "tcp", 0.1), gears, (0.0, 0.4, 0.9, 0.2, 1.0, 0.0), 60.0)


ARMS = ("parallel axes", "210 kg", "seven axes", "3 kg")


def truth(
    of: Kind, rng: np.random.Generator, tilting: float = 1.0
) -> tuple[ElasticArm, dict[str, float]]:
    """Return an arm, and the compliance of each of its springs by name, in rad/(N·m)."""
    linkage, planted, springs = Linkage.from_urdf(of.urdf, "tool"), {}, []
    for joint, origin in enumerate(joint_origins(of.robot.chain)):
        name = linkage.joint_names[joint]
        gear = planted[f"{name}.axial"] = 1e-6 * of.gears[joint] * rng.uniform(*GEAR)
        springs.append(axial_spring(linkage, joint, 1.0 / gear))
        for axis, direction in origin.directions.items():
            planted[f"{name}.{axis}"] = 0.0
            if tilting < 1.0 and rng.uniform() > tilting:
                continue
            tilt = planted[f"{name}.{axis}"] = gear * rng.uniform(*TILT)
            springs.append(TruthSpring(name, direction, Linear(1.0 / tilt), at=origin.offset))
    gravity = GRAVITY if of.robot.has_masses else (0.0, 0.0, 0.0)
    return ElasticArm(linkage, tuple(springs), gravity), planted


@dataclass(frozen=True)
class Campaign:
    """What a calibration says of its springs, and what was planted."""

    taken: str
    """The rung."""
    springs: tuple[SpringSummary, ...]
    planted: dict[str, float]
    sums: tuple[bool, ...]
    """Whether each sum of springs that are not known holds what was planted."""
    warnings: tuple[str, ...]

    def held(self) -> Iterator[tuple[str, bool]]:
        """Yield each known spring that was planted, and whether its interval holds it."""
        for each in self.springs:
            if each.observable and each.name in self.planted:
                yield each.name, each.low <= self.planted[each.name] <= each.high


@one_blas_thread()
def campaign(
    arm: str,
    poses: int,
    seed: int,
    *,
    tilting: float = 1.0,
    press: float | None = None,
    springs: str = "auto",
) -> Campaign:
    """Press at poses about a posture, by default with its kind's force, and calibrate."""
    of, rng = kind(arm), np.random.default_rng([seed, poses])
    of = of if press is None else replace(of, press=press)
    real, planted = truth(of, rng, tilting)
    spread = np.full(len(of.middle), 0.5)
    spread[-1] = 2.5
    q = np.array(of.middle) + spread * rng.uniform(-1.0, 1.0, (poses, len(spread)))
    five = press_forces(real.linkage.forward(q), 0.25 * of.press, 0.25 * of.press, of.press)
    force = np.concatenate([five, 0.45 * five[:, :1]], axis=1)
    cases = ("normal", "north", "south", "east", "west", "normal_45")
    noise = Noise(force=1e-3 * of.press, marker=15e-6)
    measured = measure(real, q, force, noise, rng, load_cases=cases)
    robot = of.robot
    readings = measured.readings(robot.joint_names)
    choice = choose_model(robot, readings, springs, FitOptions())
    options = with_knowledge(FitOptions(), choice.known, choice.model, readings)
    calibration = calibrate(choice.model, readings, rng, options, ladder=choice.ladder)
    found = calibration.calibrated
    sums = tuple(
        each.low <= sum(t.weight * planted[t.spring] for t in each.terms) <= each.high
        for each in sum_summaries(found)
        if all(t.spring in planted for t in each.terms)
    )
    summaries = spring_summaries(found, known=choice.known)
    warnings = tuple(map(str, calibration.warnings))
    return Campaign(choice.taken, summaries, planted, sums, warnings)


def held_by_spring(arm: str, poses: int, campaigns: int, tilting: float) -> dict[str, list[bool]]:
    """Return whether intervals held what was planted, by spring, in campaigns of as many arms.

    Sums of springs that are not known singly count under one name.
    """
    held: dict[str, list[bool]] = {}
    for seed in range(campaigns):
        found = campaign(arm, poses, seed, tilting=tilting)
        for name, each in found.held():
            held.setdefault(name, []).append(each)
        held.setdefault("sums", []).extend(found.sums)
    return held


@pytest.mark.slow
@pytest.mark.parametrize("tilting", TILTING)
@pytest.mark.parametrize("poses", POSES)
@pytest.mark.parametrize("arm", ARMS)
def test_the_interval_of_a_known_spring_holds_what_was_planted(arm, poses, tilting):
    """One of twenty may miss: of 25, five are more than chance makes of any spring.

    Errors of springs of one campaign hang together: of 25 all may be held, too.
    """
    held = held_by_spring(arm, POSES[poses], CAMPAIGNS, tilting)
    for name, each in held.items():
        print(f"{arm}, {poses}, {tilting}: {name} {sum(each)} of {len(each)}")
    every = np.concatenate(list(held.values()))
    assert every.mean() > 0.93
    assert all(np.sum(~np.array(each)) < 5 for name, each in held.items() if name != "sums")


def test_one_campaign_of_a_small_arm_says_what_it_knows():
    """A cheap watch on the study above."""
    found = campaign("3 kg", POSES["few"], 1)
    held = dict(found.held())
    assert {"joint_2.axial", "joint_3.axial", "joint_1.x", "joint_1.y"} <= held.keys()
    assert sum(held.values()) >= len(held) - 1


@pytest.mark.slow
def test_a_gear_is_doubted_where_tilts_that_were_left_out_could_be_part_of_it():
    """Springs of the axes alone predicted as well: joint 3 was 0.627 to 0.638, planted 0.522."""
    found = campaign("210 kg", POSES["many"], 3, tilting=0.25)
    assert found.taken == "actuated"
    held = dict(found.held())
    assert {"joint_a2.axial", "joint_a3.axial", "joint_a5.axial"} <= held.keys()
    assert all(held.values())


def test_a_gear_may_be_all_that_a_rigid_tilt_beside_it_has_of_the_noise():
    """The draws gave joint 1 0.000 to 0.289 µrad/(N·m), planted 0.316: the rest was in a tilt."""
    found = campaign("210 kg", POSES["many"], 11, tilting=0.25)
    assert dict(found.held())["joint_a1.axial"]


def test_a_soft_arm_with_its_wrist_near_axis_1_stands_where_its_joints_say():
    """There its deflection hangs so much on its joints that two rounds left 0.1 mm between both."""
    real, _ = truth(kind("3 kg"), np.random.default_rng(0))
    q = np.array([[-0.455, 0.269, -0.273, 0.297, 1.324, 1.08]])
    force = press_forces(real.linkage.forward(q), 15.0, 15.0, 60.0)
    still = Noise(force=0.0, marker=0.0, controller=0.0)
    found = measure(real, q, force, still, np.random.default_rng(0))
    there = real.linkage.forward(found.joint_position)[..., :3, 3]
    between = there - found.tcp_position[:, None] - found.controller_displacement
    assert np.abs(between).max() < 1e-6


@pytest.mark.slow
def test_an_arm_that_yields_so_far_that_its_levers_change_is_warned_of():
    """A UR10e pressed with 165 N yields 5 mm: its last tilt was held in 22 of 27 campaigns."""
    soft = campaign("parallel axes", POSES["few"], 0, press=165.0, springs="bearing")
    assert any("changes its levers" in each for each in soft.warnings)
    stiff = campaign("3 kg", POSES["few"], 0, springs="bearing")
    assert not any("changes its levers" in each for each in stiff.warnings)
