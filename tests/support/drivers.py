"""Drivers of other people: packages with an entry point, as an installation leaves them."""

import sys
from pathlib import Path

from support.plugged import describe


def install(folder: Path, monkeypatch, name: str, source: str) -> None:
    """Put a package with a driver on the path; its module has an object ``DRIVER``."""
    monkeypatch.delitem(sys.modules, name, raising=False)
    describe(folder, name, {"elastocal.drivers": {name: f"{name}:DRIVER"}})
    (folder / f"{name}.py").write_text(source)
    monkeypatch.syspath_prepend(str(folder))


REAL = '''
"""The simulated devices, as if somebody could be hurt; every enabling is noted."""
from elastocal.cell import Arming
from elastocal.errors import DeviceError
from elastocal.sim.driver import SimulatedDriver

enabled = []
moves = True


class RealDriver(SimulatedDriver):
    real = True

    def connect(self, cell, wanted, context):
        found = super().connect(cell, wanted, context)
        arm, enable = found.arm, found.arm.enable
        arm.arming = Arming()

        def checked():
            arm.arming.require(cell)
            enabled.append(cell.sha256)
            if not moves:
                raise DeviceError("this is as far as it goes")
            enable()

        arm.enable = checked
        return found


DRIVER = RealDriver()
'''
