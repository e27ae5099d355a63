"""Simulated calibrations: a KUKA-like arm pressing on a dome, true springs hidden."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from elastocal.dataset import Dataset, Readings
from elastocal.robot import Robot
from elastocal.sim.arm import (
    SHOP_FLOOR,
    Blunder,
    Linkage,
    Noise,
    elastic_arm as layouts,
    measure,
    measurement as scene,
)
from elastocal.sim.arm.elastic_arm import ElasticArm
from support.urdfs import opw_arm_urdf

QUIET = Noise()
TRACKED = Noise(force=2.0, marker=15e-6)
"""A laser tracker at two metres, averaged; the controller repeats itself."""


@cache
def urdf() -> str:
    """Return an arm with the dimensions of a KR 120 R2700 extra (hardware facts, section 7).

    Its tool reaches 150 mm aside, or the last spring would never be loaded.
    """
    arm = opw_arm_urdf(0.35, 0.041, 0.0, 0.675, 1.15, 1.2, 0.215)
    on_the_axis, aside = 'xyz="0.0 0.0 0.215"', 'xyz="0.15 0.0 0.565"'
    assert arm.count(on_the_axis) == 1
    return arm.replace(on_the_axis, aside)


@cache
def robot() -> Robot:
    return Robot.from_urdf(urdf(), "tcp")


@cache
def linkage() -> Linkage:
    return Linkage.from_urdf(urdf(), "tcp")


@cache
def linear_truth() -> ElasticArm:
    """Eighteen linear hinges: what the model can express, but for large deflections."""
    return layouts.bearing_truth(linkage())


@cache
def rich_truth() -> ElasticArm:
    """Bending links and stiffening gears on top: what no 18 springs can express."""
    joints = robot().joint_names
    bending = {joints[1]: layouts.LINK_BENDING, joints[2]: layouts.LINK_BENDING}
    return layouts.with_stiffening_gears(layouts.with_link_bending(linear_truth(), bending))


@dataclass(frozen=True)
class Cell:
    """A seeded calibration campaign."""

    arm: ElasticArm
    seed: int = 0
    poses: int = 31
    noise: Noise = SHOP_FLOOR
    blunders: tuple[Blunder, ...] = ()

    def measure(self) -> Dataset:
        rng = np.random.default_rng(self.seed)
        poses = scene.press_poses(self.arm.linkage, self.poses, rng, start=START)
        forces = scene.press_forces(poses.T_base_tcp)
        return measure(self.arm, poses.joints, forces, self.noise, rng, blunders=self.blunders)

    def readings(self) -> Readings:
        return self.measure().readings(robot().joint_names)


@cache
def unseen(arm: ElasticArm) -> Readings:
    """Return noiseless readings at poses that no seeded campaign above visits."""
    return Cell(arm, seed=20_000, poses=40, noise=QUIET).readings()


START = scene.START
