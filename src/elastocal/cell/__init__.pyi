from ._quantities import (
    IDENTITY as IDENTITY,
    Angle as Angle,
    Distance as Distance,
    Length as Length,
    Name as Name,
    Point as Point,
    Pose as Pose,
    PositiveForce as PositiveForce,
    PositiveLength as PositiveLength,
    PositiveMoment as PositiveMoment,
    PositiveSpeed as PositiveSpeed,
    PositiveTime as PositiveTime,
    SampleRate as SampleRate,
    SignedForce as SignedForce,
    TranslationalStiffness as TranslationalStiffness,
)
from .arming import Arming as Arming, RealArm as RealArm
from .cell import (
    SCHEMA as SCHEMA,
    TOOLING as TOOLING,
    Cell as Cell,
    CellFile as CellFile,
    load_cell as load_cell,
    mounted_robot as mounted_robot,
)
from .certificate import (
    ASKED as ASKED,
    CertificateEntry as CertificateEntry,
    Equipment as Equipment,
    SensorIdentity as SensorIdentity,
    TrackerIdentity as TrackerIdentity,
    certificate_of as certificate_of,
    read_statements as read_statements,
    unstated as unstated,
)
from .collision import CollisionWatch as CollisionWatch
from .devices import (
    ArmState as ArmState,
    AskedMetrology as AskedMetrology,
    BeamState as BeamState,
    Clock as Clock,
    CommandChecks as CommandChecks,
    Devices as Devices,
    ForceSensor as ForceSensor,
    Metrology as Metrology,
    Motion as Motion,
    PointBlock as PointBlock,
    RobotArm as RobotArm,
    SensorStatus as SensorStatus,
    WrenchBlock as WrenchBlock,
    close_nothing as close_nothing,
    require_duration as require_duration,
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
from .line_counts import (
    COUNTED as COUNTED,
    LineCounts as LineCounts,
    no_lines as no_lines,
    refused_telegrams as refused_telegrams,
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
from .path_arm import (
    AnswerTimes as AnswerTimes,
    CorrectedArm as CorrectedArm,
    CycleStatistics as CycleStatistics,
    PathCycle as PathCycle,
    PathDriver as PathDriver,
    PathLimits as PathLimits,
    PathSource as PathSource,
    Shift as Shift,
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
    Acceptance as Acceptance,
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
    process_forces as process_forces,
    read_production as read_production,
)
from .reading import (
    DeviceReading as DeviceReading,
    Three as Three,
    polled_readings as polled_readings,
    three as three,
)
from .rig import (
    KINDS as KINDS,
    LOOPBACK as LOOPBACK,
    SIMULATED as SIMULATED,
    DeviceChoice as DeviceChoice,
    DeviceChoices as DeviceChoices,
    DevicePlace as DevicePlace,
    DeviceSet as DeviceSet,
    DeviceSettings as DeviceSettings,
    Driver as Driver,
    LocalPort as LocalPort,
    RigContext as RigContext,
    WallClock as WallClock,
    WrenchFeed as WrenchFeed,
    WrenchSample as WrenchSample,
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
