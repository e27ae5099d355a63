from ._quantities import (
    IDENTITY as IDENTITY,
    Angle as Angle,
    AngleUpToPi as AngleUpToPi,
    Distance as Distance,
    Force as Force,
    Length as Length,
    Mass as Mass,
    Moment as Moment,
    Name as Name,
    Point as Point,
    Pose as Pose,
    PositiveForce as PositiveForce,
    PositiveLength as PositiveLength,
    PositiveMoment as PositiveMoment,
    PositiveSpeed as PositiveSpeed,
    PositiveTime as PositiveTime,
    RotationalStiffness as RotationalStiffness,
    SampleRate as SampleRate,
    Scale as Scale,
    Share as Share,
    ShareBelowHalf as ShareBelowHalf,
    SignedForce as SignedForce,
    SignedTime as SignedTime,
    StiffnessOrNone as StiffnessOrNone,
    Time as Time,
    TranslationalStiffness as TranslationalStiffness,
)
from .arming import Arming as Arming, RealArm as RealArm
from .cell import (
    TOOLING as TOOLING,
    Cell as Cell,
    CellFile as CellFile,
    load_cell as load_cell,
    mounted_robot as mounted_robot,
)
from .certificate import (
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
    UNWATCHED as UNWATCHED,
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
    require_duration as require_duration,
)
from .examples import (
    PROCESS_FILE as PROCESS_FILE,
    name_process as name_process,
    require_example as require_example,
    write_example as write_example,
)
from .hardware import (
    Box as Box,
    Cylinder as Cylinder,
    RegionEntry as RegionEntry,
    RobotEntry as RobotEntry,
    Shape as Shape,
    Sphere as Sphere,
    Tool as Tool,
    Tracker as Tracker,
)
from .identity import (
    fingerprint as fingerprint,
    named_files as named_files,
)
from .line_counts import (
    COUNTED as COUNTED,
    LineCounts as LineCounts,
    refused_telegrams as refused_telegrams,
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
from .procedure import (
    CONDITIONING as CONDITIONING,
    DEFAULT_POSES as DEFAULT_POSES,
    LIGHT_CONTACT as LIGHT_CONTACT,
    Limits as Limits,
    LoadCases as LoadCases,
    ProcedureSettings as ProcedureSettings,
)
from .production import (
    ProcessFile as ProcessFile,
    ProductionPath as ProductionPath,
    process_forces as process_forces,
    read_production as read_production,
)
from .reading import (
    DeviceReading as DeviceReading,
    polled_readings as polled_readings,
    three as three,
)
from .rig import (
    KINDS as KINDS,
    LOOPBACK as LOOPBACK,
    SIMULATED as SIMULATED,
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
from .untracked import (
    TRACKER as TRACKER,
    NoMetrology as NoMetrology,
    without_tracker as without_tracker,
)
from .visit import (
    contact_time as contact_time,
    load_case_time as load_case_time,
    straight_time as straight_time,
    visit_steps as visit_steps,
)
