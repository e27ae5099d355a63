from ._motion import name_joint_mistake as name_joint_mistake, still as still
from .plausibility import (
    DRIVE as DRIVE,
    WIND_UP as WIND_UP,
    find_implausible as find_implausible,
    find_wrong_units as find_wrong_units,
)
from .undoing import find_undone as find_undone
