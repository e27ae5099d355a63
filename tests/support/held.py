"""Readings of an arm whose tool a tooling holds, by the statics of the simulated arm."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from elastocal.dataset import Dataset
from elastocal.robot import Robot, T_from_xyzabc, catalogue, with_tool
from elastocal.sim.arm import Linkage, axial_spring, press_poses
from elastocal.sim.arm.elastic_arm import ElasticArm

PRESS = 1100.0
LOADS = PRESS * np.array([[0, 0, -1], [0.25, 0, -1], [-0.25, 0, -1], [0, -0.25, -1], [0, 0.25, -1]])
CASES = ("normal", "north", "south", "east", "west")
STIFFNESS = np.array([2.0, 2.3, 1.8, 0.5, 0.4, 0.3]) * 1e6


@cache
def robot() -> Robot:
    urdf = with_tool(
        catalogue.urdf("KR 300 R2500 ultra"),
        "flange",
        "tcp",
        T_from_xyzabc(0.15, 0.0, 0.35, 0.0, 0.3, 0.0),
    )
    return Robot.from_urdf(urdf, "tcp")


@dataclass(frozen=True)
class Held:
    """How a campaign without a tracker is done."""

    normal: float = 5e6
    lateral: float = 3e6
    poses: int = 15
    sideways: bool = True
    doubled: int = 0
    tracked: int = 0
    noise: float = 0.0
    """Standard deviation of a position of the controller, in m."""


def held_by_contact(how: Held = Held(), seed: int = 0) -> Dataset:
    """Return the dataset of presses on a tooling that yields; 6 springs, no gravity."""
    rng, arm = np.random.default_rng(seed), Linkage.from_urdf(robot().urdf, "tcp")
    springs = tuple(axial_spring(arm, i, float(k)) for i, k in enumerate(STIFFNESS))
    truth = ElasticArm(arm, springs, gravity=(0.0, 0.0, 0.0))
    pressed = press_poses(arm, how.poses, rng)
    loads, cases = (LOADS, [*CASES]) if how.sideways else (LOADS[:1], [CASES[0]])
    stack = np.ones(len(loads))
    if how.doubled:
        loads, cases = np.vstack([loads, loads]), [*cases, *(f"{name} on two" for name in cases)]
        stack = np.repeat([1, 2], len(stack))
    R, n = pressed.T_base_tcp[:, :3, :3], pressed.T_base_tcp[:, :3, 2]
    light = -0.05 * PRESS * n
    force = np.einsum("pij,lj->pli", R, loads)
    df = force - light[:, None]
    along = np.einsum("pi,pli->pl", n, df)[..., None] * n[:, None]
    given = stack[:, None] * (along / how.normal + (df - along) / how.lateral)
    q_0 = pressed.joints
    q = np.repeat(q_0[:, None], len(loads), axis=1)
    free = truth.equilibrium(q_0, light).deflection
    for _ in range(4):
        bent = truth.equilibrium(q.reshape(-1, 6), force.reshape(-1, 3)).deflection
        travel = -given - (bent.reshape(force.shape) - free[:, None])
        q = _moved(pressed.T_base_tcp, travel, q)
    travel += how.noise * rng.standard_normal(travel.shape)
    q = _moved(pressed.T_base_tcp, travel, q)
    status = np.zeros(q.shape[:2], dtype=int)
    if how.doubled:
        status[how.doubled :, stack > 1] = 4
    marker = np.where(np.arange(how.poses)[:, None, None] < how.tracked, -given, np.nan)
    return Dataset.from_arrays(
        joint_position=q,
        force=force,
        controller_displacement=travel,
        marker_displacement=marker if how.tracked else None,
        joint_names=robot().joint_names,
        load_cases=cases,
        contacts=np.tile(stack, (how.poses, 1)) if how.doubled else None,
        status=status,
        reference_joint_position=q_0,
        reference_force=light,
        gravity=(0.0, 0.0, 0.0),
        robot_name=robot().name,
        robot_urdf=robot().urdf,
        tcp_frame="tcp",
    )


def _moved(T_base_tcp: np.ndarray, travel: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return the joints at which the undeformed tool has travelled without a turn."""
    for _ in range(3):
        here, J = robot().forward(q), robot().jacobian(q)
        turn = np.cross(here[..., :3, :3], T_base_tcp[:, None, :3, :3], axis=2).sum(axis=-1) / 2.0
        missed = T_base_tcp[:, None, :3, 3] + travel - here[..., :3, 3]
        whole = np.concatenate([J.translation, J.rotation], axis=-2)
        q = q + np.linalg.solve(whole, np.concatenate([missed, turn], axis=-1)[..., None])[..., 0]
    return q
