"""The part of the package ``ur-rtde`` that is used, and how it is found."""

import importlib
from collections.abc import Sequence
from typing import Any, Protocol, cast

from elastocal.errors import DeviceError


class UrReceive(Protocol):
    """Members of ``rtde_receive.RTDEReceiveInterface`` that are used."""

    def isConnected(self) -> bool: ...
    def getTimestamp(self) -> float: ...
    def getActualQ(self) -> list[float]: ...
    def getActualTCPPose(self) -> list[float]: ...
    def getActualTCPForce(self) -> list[float]: ...
    def getFtRawWrench(self) -> list[float]: ...
    def getRobotMode(self) -> int: ...
    def getSafetyMode(self) -> int: ...
    def disconnect(self) -> None: ...


class AsyncProgress(Protocol):
    """Progress of an asynchronous motion."""

    def isAsyncOperationRunning(self) -> bool: ...


class UrControl(Protocol):
    """Members of ``rtde_control.RTDEControlInterface`` that are used; none blocks for long."""

    def isProgramRunning(self) -> bool: ...
    def reuploadScript(self) -> bool: ...
    def setWatchdog(self, min_frequency: float) -> bool: ...
    def kickWatchdog(self) -> bool: ...
    def setTcp(self, pose: Sequence[float]) -> bool: ...
    def setPayload(self, mass: float, cog: Sequence[float]) -> bool: ...
    def moveJ(
        self, q: Sequence[float], speed: float, acceleration: float, asynchronous: bool
    ) -> bool: ...
    def moveL(
        self, pose: Sequence[float], speed: float, acceleration: float, asynchronous: bool
    ) -> bool: ...
    def getAsyncOperationProgressEx(self) -> AsyncProgress: ...
    def forceMode(
        self,
        task_frame: Sequence[float],
        selection: Sequence[int],
        wrench: Sequence[float],
        kind: int,
        limits: Sequence[float],
    ) -> bool: ...
    def forceModeStop(self) -> bool: ...
    def zeroFtSensor(self) -> bool: ...
    def stopJ(self, deceleration: float, asynchronous: bool) -> None: ...
    def stopScript(self) -> None: ...
    def disconnect(self) -> None: ...


def open_receive(address: str, rate: float) -> UrReceive:
    """Return the receiving half of a connection.

    Raises
    ------
    DeviceError
        If the package is missing, or the controller does not answer.
    """
    module = _package("rtde_receive")
    try:
        return cast("UrReceive", module.RTDEReceiveInterface(address, rate))
    except RuntimeError as error:
        raise DeviceError(f"rtde: {_one_line(error)}") from error


def open_control(address: str, rate: float) -> UrControl:
    """Return the commanding half: its program is loaded into the controller and runs.

    Raises
    ------
    DeviceError
        If the package is missing, the controller does not answer, or the program does not start.
    """
    module = _package("rtde_control")
    interface = module.RTDEControlInterface
    flags = interface.FLAG_UPLOAD_SCRIPT | interface.FLAG_NO_EXT_FT
    try:
        return cast("UrControl", interface(address, rate, flags))
    except RuntimeError as error:
        raise DeviceError(f"rtde: {_one_line(error)}") from error


def _package(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise DeviceError(
            "the driver 'rtde' needs the package ur-rtde: pip install 'elastocal[ur]'"
        ) from error


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
