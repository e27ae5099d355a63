"""Readings: the usable part of a dataset as flat arrays, one row a reading."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from elastocal.dataset._layout import FloatArray, IntArray, StringArray, freeze
from elastocal.errors import DatasetError, nearest
from elastocal.results import brief_repr

_LARGEST = 1e9
"""No SI number of a robot's reading comes near; what does is a damaged file."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Readings:
    """Readings that are ok, in (pose, load case) order; all arrays are read-only copies.

    Raises
    ------
    DatasetError
        If the shapes do not belong together or a number is not finite.
    """

    pose: IntArray
    """Label of the pose of each reading, shape (reading,)."""
    load_case: StringArray
    """Load case of each reading, shape (reading,)."""
    joint_position: FloatArray
    """Joint positions after settling (paper: Theta^c), shape (reading, joint), in rad or m."""
    force: FloatArray
    """Force on the robot at the TCP in base (paper: F^m), shape (reading, 3), in N."""
    controller_displacement: FloatArray
    """TCP displacement by the controller, in base (P^c), shape (reading, 3), in m."""
    marker_displacement: FloatArray
    """Marker displacement by the tracker, in base (P^m), shape (reading, 3), in m."""
    moment: FloatArray | None = None
    """Moment on the robot at the TCP in base, shape (reading, 3), in N·m; None: not measured."""
    force_sigma: FloatArray | None = None
    """Standard deviation of the force, shape (reading, 3), in N; None: not known."""
    marker_sigma: FloatArray | None = None
    """Standard deviation of the marker displacement, shape (reading, 3), in m; None: not known."""
    tcp_position: FloatArray | None = None
    """Unloaded TCP position in base, shape (reading, 3), in m; None: not known."""

    def __post_init__(self) -> None:
        self._own("pose", np.array(self.pose, dtype=np.int64), (len(self.pose),))
        self._own("load_case", np.array(self.load_case, dtype=np.str_), (len(self.pose),))
        for name, value in self._numbers():
            array = np.array(value, dtype=np.float64)
            width = array.shape[-1] if name == "joint_position" and array.ndim else 3
            self._own(name, array, (len(self.pose), width))
            usable = np.abs(array) < _LARGEST
            if not np.all(usable):
                row = int(np.argwhere(~usable)[0, 0])
                raise DatasetError(
                    f"{name} of pose {self.pose[row]}, load case {str(self.load_case[row])!r}"
                    f" is {array[row].tolist()}: every number of a reading must be finite and"
                    f" below {_LARGEST:g} in SI units"
                )

    def __len__(self) -> int:
        return len(self.pose)

    @property
    def deflection(self) -> FloatArray:
        """Real minus commanded TCP position, shape (reading, 3), in m (spec section 1).

        ``deflection = marker_displacement - controller_displacement``: the paper's Eq. (10)
        and (13) with both signs turned.
        """
        deflection: FloatArray = self.marker_displacement - self.controller_displacement
        freeze(deflection)
        return deflection

    def take(self, index: ArrayLike) -> "Readings":
        """Return some of the readings, in the order asked for, repeated ones included.

        Parameters
        ----------
        index : array_like of int or bool, shape (n,) or (reading,)
            Rows, or a mask of them.

        Raises
        ------
        IndexError
            If a row does not exist.
        """
        chosen = np.asarray(index)
        rows = np.arange(len(self))[chosen.astype(np.intp) if chosen.size == 0 else chosen]
        numbers = {name: value[rows] for name, value in self._numbers()}
        return Readings(self.pose[rows], self.load_case[rows], **numbers)

    def _numbers(self) -> Iterator[tuple[str, FloatArray]]:
        for field in fields(self)[2:]:
            value = getattr(self, field.name)
            if value is not None:
                yield field.name, value

    def _own(self, name: str, array: np.ndarray, shape: tuple[int, ...]) -> None:
        if array.shape != shape:
            raise DatasetError(f"{name} of the readings has shape {array.shape}, not {shape}")
        freeze(array)
        object.__setattr__(self, name, array)


def without(readings: Readings, excluded: Sequence[str]) -> Readings:
    """Return the readings without those named ``POSE`` or ``POSE:LOAD_CASE``.

    Raises
    ------
    DatasetError
        If a name matches no reading, or none is left.
    """
    keep = np.ones(len(readings), dtype=bool)
    for name in excluded:
        keep &= ~_named(readings, name)
    if not np.any(keep):
        raise DatasetError(f"--exclude {' '.join(excluded)} leaves no reading")
    return readings.take(keep)


def _named(readings: Readings, name: str) -> np.ndarray:
    pose, _, load_case = name.partition(":")
    try:
        mask = readings.pose == int(pose)
    except ValueError as error:
        raise DatasetError(f"--exclude {name!r} must be POSE or POSE:LOAD_CASE") from error
    if not np.any(mask):
        raise DatasetError(f"--exclude {name!r}: there is no usable reading at pose {pose}")
    if load_case:
        cases = sorted(set(readings.load_case[mask].tolist()))
        mask &= readings.load_case == load_case
        if not np.any(mask):
            raise DatasetError(
                f"--exclude {name!r}: pose {pose} has no load case {load_case!r}"
                f"{nearest(load_case, cases)} (it has {', '.join(cases)})"
            )
    return np.asarray(mask)
