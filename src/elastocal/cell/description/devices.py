"""Which devices carry a run out."""

from elastocal.records import StrictModel

SIMULATED = "simulated"
"""Name of the device of each kind that needs no hardware."""


class DeviceNames(StrictModel):
    """Name of each device; which names there are is known to `elastocal run`."""

    arm: str = SIMULATED
    sensor: str = SIMULATED
    """Force/torque sensor."""
    metrology: str = SIMULATED
    """Laser trackers."""
