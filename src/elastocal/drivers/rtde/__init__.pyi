from .arm import UrArm as UrArm
from .driver import DRIVER as DRIVER, RtdeDriver as RtdeDriver, RtdeSettings as RtdeSettings
from .line import (
    T_of_pose as T_of_pose,
    UrLine as UrLine,
    UrSample as UrSample,
    UrSensor as UrSensor,
    pose_of_T as pose_of_T,
)
