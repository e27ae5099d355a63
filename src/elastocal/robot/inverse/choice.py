"""Which solver a robot gets."""

from elastocal.robot.inverse.numerical import NumericalInverse
from elastocal.robot.inverse.opw import OpwInverse
from elastocal.robot.inverse.opw_geometry import NotOrthoParallelError
from elastocal.robot.inverse.protocol import InverseKinematics
from elastocal.robot.robot import Robot


def inverse_for(robot: Robot, seed: int = 0) -> InverseKinematics:
    """Return the solver for a robot: closed form if its arm has one, else numerical.

    Parameters
    ----------
    robot : Robot
        Its last six joints are the arm, those before it external axes.
    seed : int
        Seed of the numerical solver, should it be needed.

    Returns
    -------
    OpwInverse or NumericalInverse
        The latter's ``reason`` says what the closed form failed on.
    """
    try:
        return OpwInverse(robot)
    except NotOrthoParallelError as error:
        return NumericalInverse(robot, seed=seed, reason=str(error))
