from .cell import Cell as Cell, load_cell as load_cell
from .devices import SIMULATED as SIMULATED, DeviceNames as DeviceNames
from .faults import Fault as Fault
from .file import SCHEMA as SCHEMA, TOOLING as TOOLING, CellFile as CellFile
from .loads import DIRECTIONS as DIRECTIONS
from .procedure import ProcedureSettings as ProcedureSettings
from .quantities import (
    Angle as Angle,
    Distance as Distance,
    PositiveForce as PositiveForce,
    PositiveLength as PositiveLength,
    PositiveMoment as PositiveMoment,
)
from .search import DEFAULT_POSES as DEFAULT_POSES
from .shapes import Box as Box, Cylinder as Cylinder, Shape as Shape, Sphere as Sphere
from .simulation_truth import Gears as Gears
