from ._quantities import (
    Angle as Angle,
    Distance as Distance,
    PositiveForce as PositiveForce,
    PositiveLength as PositiveLength,
    PositiveMoment as PositiveMoment,
)
from .cell import (
    SCHEMA as SCHEMA,
    TOOLING as TOOLING,
    Cell as Cell,
    CellFile as CellFile,
    ProcessFile as ProcessFile,
    load_cell as load_cell,
)
from .loads import (
    DIRECTIONS as DIRECTIONS,
    Engagement as Engagement,
    Limits as Limits,
    LoadCases as LoadCases,
    TorqueLimits as TorqueLimits,
)
from .motion import (
    MotionEntry as MotionEntry,
    axis_speeds as axis_speeds,
    external_positions as external_positions,
    home_position as home_position,
)
from .procedure import (
    DEFAULT_POSES as DEFAULT_POSES,
    SIMULATED as SIMULATED,
    Acceptance as Acceptance,
    DeviceNames as DeviceNames,
    ProcedureSettings as ProcedureSettings,
    Search as Search,
)
from .robot import (
    Marker as Marker,
    RailEntry as RailEntry,
    RobotEntry as RobotEntry,
    SensorEntry as SensorEntry,
    Tool as Tool,
    Tracker as Tracker,
)
from .simulation import (
    Balancer as Balancer,
    Bearings as Bearings,
    ContactTruth as ContactTruth,
    ControllerTruth as ControllerTruth,
    EndEffector as EndEffector,
    ExternalAxes as ExternalAxes,
    Fault as Fault,
    FaultKind as FaultKind,
    Floor as Floor,
    Gears as Gears,
    Links as Links,
    SensorTruth as SensorTruth,
    Simulation as Simulation,
    TrackerTruth as TrackerTruth,
    TruthScale as TruthScale,
)
from .surface import (
    Box as Box,
    Cylinder as Cylinder,
    MeshFile as MeshFile,
    RegionBox as RegionBox,
    RegionEntry as RegionEntry,
    RegionPolygon as RegionPolygon,
    Shape as Shape,
    Sphere as Sphere,
    SurfaceEntry as SurfaceEntry,
)
