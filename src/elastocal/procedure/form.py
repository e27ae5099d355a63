"""Whether what a device says can be what it says: shapes, and numbers that are numbers."""

import math

from elastocal.arrays import FloatArray
from elastocal.cell.devices import ArmState, PointBlock, WrenchBlock
from elastocal.procedure.faults import Fault, FaultError


def check_arm(state: ArmState, joints: int) -> None:
    """Refuse a state that names no place.

    Parameters
    ----------
    state : ArmState
        Of the arm.
    joints : int
        Number of its joints.

    Raises
    ------
    FaultError
        With what is wrong.
    """
    for name, values, shape in (
        ("joint positions", state.q, (joints,)),
        ("tool frame", state.T_base_tcp, (4, 4)),
    ):
        if values.shape != shape:
            text = f"{state.source}: {name} of shape {values.shape}, not {shape}"
            raise FaultError(Fault.ARM_FAULT, text)
        if not math.isfinite(values.sum()):
            raise FaultError(Fault.ARM_FAULT, f"{state.source}: {name} are not finite numbers")


def check_wrenches(block: WrenchBlock) -> None:
    """Refuse a block whose samples are no wrenches or have no time.

    Raises
    ------
    FaultError
        With what is wrong.
    """
    fault = Fault.SENSOR_FAULT
    _check_rows(fault, block.source, block.time, {"forces": block.force, "moments": block.moment})


def check_points(block: PointBlock) -> None:
    """Refuse a block whose samples are no points or have no time.

    Raises
    ------
    FaultError
        With what is wrong.
    """
    rows = {"positions": block.position, "sigmas": block.sigma}
    _check_rows(Fault.TRACKER_FAULT, block.source, block.time, rows)


def _check_rows(fault: Fault, source: str, time: FloatArray, rows: dict[str, FloatArray]) -> None:
    if time.ndim != 1 or not math.isfinite(time.sum()):
        raise FaultError(fault, f"{source}: its times are not a row of finite numbers")
    for name, values in rows.items():
        if values.shape != (len(time), 3):
            text = f"{source}: {name} of shape {values.shape}, not {(len(time), 3)}"
            raise FaultError(fault, text)
