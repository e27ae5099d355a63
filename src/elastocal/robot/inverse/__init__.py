"""Inverse kinematics: every joint configuration that reaches a pose."""

from elastocal.robot.inverse.choice import inverse_for
from elastocal.robot.inverse.limits import turns
from elastocal.robot.inverse.numerical import NumericalInverse
from elastocal.robot.inverse.opw import OpwInverse
from elastocal.robot.inverse.opw_geometry import (
    NotOrthoParallelError,
    OpwGeometry,
    OpwParameters,
    derive_opw,
)
from elastocal.robot.inverse.protocol import InverseKinematics, InverseSolutions

__all__ = [
    "InverseKinematics",
    "InverseSolutions",
    "NotOrthoParallelError",
    "NumericalInverse",
    "OpwGeometry",
    "OpwInverse",
    "OpwParameters",
    "derive_opw",
    "inverse_for",
    "turns",
]
