from .protocols import (
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
