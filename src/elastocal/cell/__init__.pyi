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
    load_cell as load_cell,
)
from .devices import (
    ArmState as ArmState,
    BeamState as BeamState,
    Clock as Clock,
    Devices as Devices,
    ForceSensor as ForceSensor,
    Metrology as Metrology,
    Motion as Motion,
    PointBlock as PointBlock,
    RobotArm as RobotArm,
    SensorStatus as SensorStatus,
    WrenchBlock as WrenchBlock,
)
from .examples import (
    BLOCK_SIZE as BLOCK_SIZE,
    EXAMPLES as EXAMPLES,
    PROCESS_FILE as PROCESS_FILE,
    Example as Example,
    binary_stl as binary_stl,
    block_mesh as block_mesh,
    dome_section as dome_section,
    name_process as name_process,
    require_example as require_example,
    write_example as write_example,
)
from .hardware import (
    Box as Box,
    Cylinder as Cylinder,
    Marker as Marker,
    MeshFile as MeshFile,
    RailEntry as RailEntry,
    RegionBox as RegionBox,
    RegionEntry as RegionEntry,
    RegionPolygon as RegionPolygon,
    RobotEntry as RobotEntry,
    SensorEntry as SensorEntry,
    Shape as Shape,
    Sphere as Sphere,
    SurfaceEntry as SurfaceEntry,
    Tool as Tool,
    Tracker as Tracker,
)
from .identity import (
    RUN_SECTIONS as RUN_SECTIONS,
    fingerprint as fingerprint,
    named_files as named_files,
)
from .motion import (
    MotionEntry as MotionEntry,
    axis_speeds as axis_speeds,
    external_positions as external_positions,
    home_position as home_position,
    joint_margins as joint_margins,
    joint_positions as joint_positions,
    torque_limits as torque_limits,
)
from .presets import (
    PRESET_FIGURES as PRESET_FIGURES,
    PRESETS as PRESETS,
    Preset as Preset,
    PresetFigure as PresetFigure,
    kind_default as kind_default,
    with_preset as with_preset,
)
from .procedure import (
    CONDITIONING as CONDITIONING,
    DEFAULT_POSES as DEFAULT_POSES,
    DIRECTIONS as DIRECTIONS,
    LIGHT_CONTACT as LIGHT_CONTACT,
    SIMULATED as SIMULATED,
    Acceptance as Acceptance,
    DeviceNames as DeviceNames,
    Engagement as Engagement,
    Limits as Limits,
    LoadCases as LoadCases,
    ProcedureSettings as ProcedureSettings,
    Search as Search,
    TorqueLimits as TorqueLimits,
)
from .production import (
    ProcessFile as ProcessFile,
    ProductionPath as ProductionPath,
    read_production as read_production,
)
from .sensor import (
    SENSOR_CORRECTED as SENSOR_CORRECTED,
    SensorLoad as SensorLoad,
    weight_response as weight_response,
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
    Geometry as Geometry,
    Links as Links,
    SensorTruth as SensorTruth,
    Simulation as Simulation,
    Thermal as Thermal,
    TrackerTruth as TrackerTruth,
    TruthScale as TruthScale,
)
from .visit import (
    VisitStep as VisitStep,
    contact_time as contact_time,
    load_case_time as load_case_time,
    straight_time as straight_time,
    visit_steps as visit_steps,
)
