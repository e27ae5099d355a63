"""A campaign without a tracker on an arm of `independent.mujoco_truth`: a tip on a plate.

The tool touches the plate lightly, where the controller's position is read; then it presses, load
case by load case, while the controller follows until the *deformed* arm holds the tip where the
plate has gone. The law of the contact stands here once more, with a matrix for each place, and the
equilibrium knows no column of the estimator. No two places are equally stiff, the controller's
positions are off by some micrometres, and the tip creeps sideways from press to press.
"""

from dataclasses import dataclass

import numpy as np

from elastocal.dataset import Dataset
from elastocal.robot import Robot
from independent.mujoco_truth import PRESSES, MujocoArm

LEVELS = (*PRESSES, 0.45 * PRESSES[0])
CASES = ("normal", "north", "south", "east", "west", "light")
DOUBLED = "normal on two"
_THICKNESS = 5e-3
"""Of a disk, in m: on two the tool stands that much farther from the plate."""
_LIGHT = 0.05
"""Part of the press with which the tool touches."""


@dataclass(frozen=True)
class Plate:
    """A contact and how a campaign on it is done."""

    normal: float
    """Stiffness of one disk or tip along the normal, in N/m."""
    lateral: float
    """Across it, in N/m."""
    spread: float
    """Standard deviation of a place, as a share."""
    doubled: int = 0
    """Poses at which the tool presses on two disks as well."""
    tracked: int = 0
    """First poses, which a tracker measures too."""
    stop: float = 10e-6
    """Standard deviation of a position of the controller, in m."""
    slip: float = 1e-6
    """Standard deviation of the creep from press to press, in m."""
    force_noise: float = 1.0
    """In N."""
    sideways: bool = True
    """Whether it presses sideways too."""


STEEL = Plate(50e6, 35e6, 0.2)
URETHANE = Plate(4e6, 1.5e6, 0.1)


def contact_campaign(
    arm: MujocoArm, robot: Robot, q: np.ndarray, plate: Plate, rng: np.random.Generator
) -> Dataset:
    """Return what controller and sensor say of presses at some poses, shape (pose, joint)."""
    loads = arm.drawing.press * np.array(LEVELS if plate.sideways else [LEVELS[0], LEVELS[-1]])
    cases = list(CASES if plate.sideways else (CASES[0], CASES[-1]))
    if plate.doubled:
        loads, cases = np.vstack([loads, loads[:1]]), [*cases, DOUBLED]
    shape = (len(q), len(loads), 3)
    joints, moved = np.empty((*shape[:2], q.shape[1])), np.empty(shape)
    force, seen = np.empty(shape), np.full(shape, np.nan)
    contacts = np.ones(shape[:2], dtype=np.int8)
    status = np.zeros(shape[:2], dtype=np.int8)
    references, touching = np.empty_like(q), np.empty((len(q), 3))
    for pose, here in enumerate(q):
        place = _Place(arm, here, plate, rng)
        references[pose], touching[pose] = place.joints, place.light
        for case, load in enumerate(loads):
            force[pose, case] = place.R @ load
            if cases[case] == DOUBLED:
                contacts[pose, case] = 2
                status[pose, case] = 0 if pose < plate.doubled else 4
                place.touch(2)
            pressed = place.press(force[pose, case])
            joints[pose, case], moved[pose, case] = pressed
            if pose < plate.tracked:
                seen[pose, case] = place.went + 15e-6 * rng.standard_normal(3)
    force += plate.force_noise * rng.standard_normal(shape)
    return Dataset.from_arrays(
        joint_position=joints,
        force=force,
        controller_displacement=moved,
        marker_displacement=seen if plate.tracked else None,
        joint_names=robot.joint_names,
        load_cases=cases,
        contacts=contacts if plate.doubled else None,
        status=status,
        reference_joint_position=references,
        reference_force=touching,
        robot_name="independent",
        robot_urdf=arm.drawing.urdf,
        tcp_frame="tcp",
        provenance="tests/independent",
    )


class _Place:
    """A place of the plate, and the arm that presses there."""

    def __init__(self, arm: MujocoArm, q: np.ndarray, plate: Plate, rng) -> None:
        self.arm, self.plate, self.rng = arm, plate, rng
        self.T = arm.rigid(q)
        self.R, n = self.T[:3, :3], self.T[:3, 2]
        soft = (1.0 + plate.spread * rng.standard_normal(2)) / (plate.normal, plate.lateral)
        across = np.eye(3) - np.outer(n, n)
        self.compliance = soft[0] * np.outer(n, n) + soft[1] * across
        self.light = -_LIGHT * arm.drawing.press * n
        self.surface, _ = arm.equilibrium(q, self.light, np.zeros(len(arm.k)))
        self.surface = self.surface + self.compliance @ self.light
        self.start = q
        self.touch(1)

    def touch(self, disks: int) -> None:
        """Touch lightly on some disks, and read the controller's position."""
        self.disks, self.crept = disks, np.zeros(3)
        self.foot = self.surface - (disks - 1) * _THICKNESS * self.T[:3, 2]
        self.real = self._where(self.light)
        self.q = self._held(self.real, self.light, self.start)
        self.joints = self._read(self.q)
        self.zero = self.arm.rigid(self.joints)[:3, 3]

    def press(self, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Press; return the joints and the displacement that the controller says."""
        creep = self.plate.slip * self.rng.standard_normal(3)
        self.crept += creep - (creep @ self.T[:3, 2]) * self.T[:3, 2]
        goal = self._where(force) + self.crept
        self.went = goal - self.real
        joints = self._read(self._held(goal, force, self.q))
        return joints, self.arm.rigid(joints)[:3, 3] - self.zero

    def _where(self, force: np.ndarray) -> np.ndarray:
        """Return where the tip stands: the plate gives way against the force on the robot."""
        return self.foot - self.disks * self.compliance @ force

    def _held(self, goal: np.ndarray, force: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Return the joints at which the deformed arm holds the tip there."""
        for _ in range(5):
            tip, _ = self.arm.equilibrium(q, force, np.zeros(len(self.arm.k)))
            T = self.T.copy()
            T[:3, 3] = self.arm.rigid(q)[:3, 3] + goal - tip
            q = self.arm.joints_at(T, q)
        return q

    def _read(self, q: np.ndarray) -> np.ndarray:
        """Return the joints that the controller says, whose tip is off by its error."""
        T = self.arm.rigid(q)
        T[:3, 3] += self.plate.stop * self.rng.standard_normal(3)
        return self.arm.joints_at(T, q)
