"""All drivers by name: those here, the simulator, and those of packages that are installed."""

import pkgutil
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from elastocal.cell import SIMULATED, Driver
from elastocal.errors import DeviceError
from elastocal.plugins import Registry


@cache
def _own() -> Mapping[str, str]:
    # What several drivers share is a module beside their packages.
    found = pkgutil.iter_modules([str(Path(__file__).parent)])
    packages = sorted(module.name for module in found if module.ispkg)
    return {SIMULATED: "elastocal.sim:DRIVER"} | {
        name: f"elastocal.drivers.{name}:DRIVER" for name in packages
    }


DRIVERS: Registry[Driver] = Registry("driver", _own, DeviceError)
"""Drivers by name; each is imported when it is asked for."""
