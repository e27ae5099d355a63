"""Posture choice by elastostatic stiffness (paper section 4.3.1).

See `directional` for the measure, `survey` for all postures along a path, `choose` for the best.
"""

from elastocal.compensation.stiffness.choose import Choice, Hold, choose
from elastocal.compensation.stiffness.directional import (
    Directional,
    Ellipsoid,
    directional,
    ellipsoid,
)
from elastocal.compensation.stiffness.permits import Permit, cell_permit, same_robot, within_limits
from elastocal.compensation.stiffness.stations import Stations, read_stations
from elastocal.compensation.stiffness.survey import Grid, Survey, survey
from elastocal.compensation.stiffness.tables import write_choice, write_survey

__all__ = [
    "Choice",
    "Directional",
    "Ellipsoid",
    "Grid",
    "Hold",
    "Permit",
    "Stations",
    "Survey",
    "cell_permit",
    "choose",
    "directional",
    "ellipsoid",
    "read_stations",
    "same_robot",
    "survey",
    "within_limits",
    "write_choice",
    "write_survey",
]
