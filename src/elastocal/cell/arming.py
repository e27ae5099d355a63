"""Permission to move a real arm: a person's agreement to the exact contents of one cell file.

It is created where a person agrees (`elastocal.workflows`), passed through the rig, and required by
the driver that enables the arm. A cell file that has changed since is refused.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from elastocal.cell.devices import RobotArm
from elastocal.errors import DeviceError
from elastocal.results import brief_repr

if TYPE_CHECKING:
    from elastocal.cell.cell import Cell


@brief_repr
@dataclass(frozen=True)
class Arming:
    """Agreement of a person to move an arm."""

    cell_sha256: str = ""
    """SHA-256 of the cell file that the person was shown; see `Cell.sha256`. Empty: no
    agreement."""
    real: bool = False
    """Whether an arm that is not simulated may move."""

    @classmethod
    def of(cls, cell: "Cell") -> "Arming":
        """Return the arming of a cell as it was read."""
        return cls(cell.sha256, real=True)

    def require(self, cell: "Cell", real: bool = True) -> None:
        """Refuse what was not agreed to; every driver of an arm that can hurt asks before it moves.

        Parameters
        ----------
        cell : Cell
            As it was read.
        real : bool
            Whether its arm can hurt.

        Raises
        ------
        DeviceError
            If the file is another one, or its arm can hurt and may not move.
        """
        if self.cell_sha256 and self.cell_sha256 != cell.sha256:
            raise DeviceError(
                f"{cell.path} has changed since it was agreed to: nothing moves before somebody has"
                " looked at it again"
            )
        if real and not (self.real and self.cell_sha256):
            raise DeviceError(f"{cell.path}: the arm is not armed: nothing moves")


@runtime_checkable
class RealArm(RobotArm, Protocol):
    """An arm that can hurt: `RobotArm.enable` is refused without its arming (`Arming.require`)."""

    arming: Arming
    """``Arming()`` until a person has agreed."""
