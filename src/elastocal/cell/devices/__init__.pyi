from .arm import ArmState as ArmState, Motion as Motion, RobotArm as RobotArm
from .clock import Clock as Clock
from .devices import Devices as Devices
from .force_sensor import (
    ForceSensor as ForceSensor,
    SensorStatus as SensorStatus,
    WrenchBlock as WrenchBlock,
)
from .metrology import BeamState as BeamState, Metrology as Metrology, PointBlock as PointBlock
