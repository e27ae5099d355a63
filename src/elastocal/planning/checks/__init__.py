"""Checks of calibration poses, one file each.

A new check is one file here, an export, a changelog line, and an entry in
``tests/contracts/test_checks.py``.
"""

from elastocal.planning.checks.check import Check, Checks, PointCheck, Verdicts, verdicts
from elastocal.planning.checks.collision import CollisionCheck
from elastocal.planning.checks.engagement import EdgeCheck, FlatnessCheck
from elastocal.planning.checks.friction import FrictionCheck
from elastocal.planning.checks.joint_limits import JointLimitsCheck, TravelLimitsCheck
from elastocal.planning.checks.sensor import SensorCheck
from elastocal.planning.checks.sight import SightCheck, Station
from elastocal.planning.checks.singularity import SingularityCheck, WristCheck
from elastocal.planning.checks.torque import TorqueCheck

__all__ = [
    "Check",
    "Checks",
    "CollisionCheck",
    "EdgeCheck",
    "FlatnessCheck",
    "FrictionCheck",
    "JointLimitsCheck",
    "PointCheck",
    "SensorCheck",
    "SightCheck",
    "SingularityCheck",
    "Station",
    "TorqueCheck",
    "TravelLimitsCheck",
    "Verdicts",
    "WristCheck",
    "verdicts",
]
