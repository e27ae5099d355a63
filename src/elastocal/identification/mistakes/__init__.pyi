from ._motion import name_joint_mistake as name_joint_mistake, still as still
from .plausibility import DRIVE as DRIVE, WIND_UP as WIND_UP
from .search import find_mistakes as find_mistakes
