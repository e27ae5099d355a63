"""The rigid robot: model, inverse kinematics, singularities, catalogue."""

from elastocal.robot.robot import GRAVITY, Jacobian, JointLimits, Robot

__all__ = ["GRAVITY", "Jacobian", "JointLimits", "Robot"]
