"""What a robot in its cell needs to be moved about: its speeds, its surroundings, its solver."""

from dataclasses import dataclass

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.planning.motion.durations import AxisMotion
from elastocal.planning.motion.sweep import Sweep
from elastocal.planning.motion.vias import detours, lifted
from elastocal.planning.scene import CollisionScene
from elastocal.robot.inverse import InverseKinematics, inverse_for


@dataclass(frozen=True, eq=False)
class Mover:
    """How long moves take, which are free of collision, and where via poses can be."""

    axes: AxisMotion
    sweep: Sweep
    solver: InverseKinematics

    def lifted(self, q_approach: FloatArray, normal: FloatArray) -> FloatArray:
        """Return via postures off an approach pose, shape (lift, joint); see `vias.lifted`."""
        return lifted(self.solver, q_approach, normal)

    def detours(self, start: FloatArray, end: FloatArray) -> FloatArray:
        """Return via postures about a way, shape (detour, joint); see `vias.detours`."""
        return detours(self.solver.robot, start, end)


def mover_for(cell: Cell, scene: CollisionScene) -> Mover:
    """Return what moves a cell's robot, with the speeds and the clearance of its file.

    Parameters
    ----------
    cell : Cell
        The cell.
    scene : CollisionScene
        Its robot and tool among tooling and fixtures.
    """
    motion, limits = cell.file.motion, cell.file.limits
    return Mover(
        AxisMotion(cell.axis_speeds, motion.acceleration_time),
        Sweep(scene, limits.clearance),
        inverse_for(cell.robot),
    )


def contact_time(cell: Cell) -> float:
    """Return the estimated time at one pose, in s.

    From the approach pose down and back up, the unloaded reference, and all load cases:

        2 approach_distance / contact_speed + unloaded_time + load cases * load_time.
    """
    motion = cell.file.motion
    there_and_back = 2.0 * cell.file.engagement.approach_distance / motion.contact_speed
    loads = len(cell.file.load_cases.cases) * motion.load_time
    return there_and_back + motion.unloaded_time + loads
