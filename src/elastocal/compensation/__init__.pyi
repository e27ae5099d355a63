from .settings import (
    CompensatorSettings as CompensatorSettings,
    CorrectionLimits as CorrectionLimits,
    FixedFrame as FixedFrame,
    SensorRange as SensorRange,
    read_settings as read_settings,
)
