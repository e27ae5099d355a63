"""Readings: the usable part of a dataset as flat arrays, one row a reading."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray
from elastocal.dataset._layout import (
    FloatArray,
    IntArray,
    StatusArray,
    StringArray,
    freeze,
)
from elastocal.errors import DatasetError, nearest
from elastocal.results import brief_repr

_LARGEST = 1e9
"""No SI number of a robot's reading comes near; what does is a damaged file."""
_NO_NUMBERS = (
    *("pose", "load_case", "sequence", "contacts", "campaign"),
    *("conditioned", "also_pressed", "doubts"),
)
"""Fields that are labels or say how all readings were taken."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Presses:
    """Presses without a usable reading that belong to the history of the torques."""

    pose: IntArray
    """Label of the pose of each, shape (press,)."""
    sequence: IntArray
    """Place of each in time among presses and readings of its pose, shape (press,)."""
    joint_position: FloatArray
    """Shape (press, joint), in rad or m."""
    force: FloatArray
    """Force on the robot at the TCP in base, shape (press, 3), in N."""
    moment: FloatArray | None = None
    """Moment on the robot at the TCP in base, shape (press, 3), in N·m; None: not measured."""

    def with_others(self, others: "Presses") -> "Presses":
        """Return these presses and others of the same campaign."""
        moments = [each.moment for each in (self, others) if each.moment is not None]
        return Presses(
            np.concatenate([self.pose, others.pose]),
            np.concatenate([self.sequence, others.sequence]),
            np.concatenate([self.joint_position, others.joint_position]),
            np.concatenate([self.force, others.force]),
            np.concatenate(moments) if moments else None,
        )


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
    """Marker displacement by the tracker, in base (P^m), shape (reading, 3), in m; zero where none
    measured: there the tooling holds the tool in its place (`contacts`)."""
    moment: FloatArray | None = None
    """Moment on the robot at the TCP in base, shape (reading, 3), in N·m; None: not measured."""
    force_sigma: FloatArray | None = None
    """Standard deviation of the force, shape (reading, 3), in N; None: not known."""
    marker_sigma: FloatArray | None = None
    """Standard deviation of the marker displacement, shape (reading, 3), in m; None: not known."""
    tcp_position: FloatArray | None = None
    """Unloaded TCP position in base, shape (reading, 3), in m; None: not known."""
    reference_joint_position: FloatArray | None = None
    """Joint positions when the zero of both displacements was read, shape (reading, joint), in rad
    or m; None: where the controller displacement at constant orientation began."""
    link_joint_position: FloatArray | None = None
    """Positions of the links by secondary encoders, shape (reading, joint), in rad or m; NaN
    throughout at a joint that has none."""
    reference_link_joint_position: FloatArray | None = None
    """The same when the zero of both displacements was read; None: each pose has a zero of its own
    that is not known."""
    reference_force: FloatArray | None = None
    """Force on the robot at the TCP in base then, shape (reading, 3), in N; None: none."""
    sequence: IntArray | None = None
    """Place of each reading in time among those of its pose, shape (reading,); None: their order
    here."""
    contacts: StatusArray | None = None
    """Disks or tips stacked between tool and tooling at each reading that no tracker measured,
    shape (reading,); 0 where one did, None: it measured all. The displacement of a reading of
    another stack than the pose's first counts from a light contact on its own stack."""
    conditioned: bool = False
    """Whether each pose's first reading is a press made before the zero was read; else the arm
    came to the zero by free moves."""
    campaign: StringArray | None = None
    """Campaign of each reading, shape (reading,); None: there are none."""
    also_pressed: Presses | None = None
    """Presses without a usable reading, such as one that slipped; None: not recorded. `take` keeps
    those of all poses, since friction remembers them."""
    doubts: tuple[str, ...] = ()
    """Mistakes that `import` suspected in them, as sentences."""

    def __post_init__(self) -> None:
        self._own("pose", np.array(self.pose, dtype=np.int64), (len(self.pose),))
        self._own("load_case", np.array(self.load_case, dtype=np.str_), (len(self.pose),))
        if self.sequence is not None:
            self._own("sequence", np.array(self.sequence, dtype=np.int64), (len(self.pose),))
        elif self.also_pressed is not None:
            raise DatasetError("readings with other presses between them need their sequence")
        if self.contacts is not None:
            self._own("contacts", np.array(self.contacts, dtype=np.int8), (len(self.pose),))
        if self.campaign is not None:
            self._own("campaign", np.array(self.campaign, dtype=np.str_), (len(self.pose),))
        for name, value in self._numbers():
            array = np.array(value, dtype=np.float64)
            width = array.shape[-1] if name.endswith("joint_position") and array.ndim else 3
            self._own(name, array, (len(self.pose), width))
            usable = np.abs(array) < _LARGEST
            if "link" in name:
                usable |= np.isnan(array).all(axis=0)
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
    def disks(self) -> StatusArray:
        """Disks between tool and tooling, shape (reading,); 0 where a tracker measured."""
        return np.zeros(len(self), dtype=np.int8) if self.contacts is None else self.contacts

    @property
    def by_contact(self) -> BoolArray:
        """Whether the tooling held the tool and no tracker measured, shape (reading,)."""
        return np.asarray(self.disks > 0)

    @property
    def encoders(self) -> tuple[int, ...]:
        """Numbers of the joints that have a secondary encoder."""
        if self.link_joint_position is None:
            return ()
        there = ~np.isnan(self.link_joint_position).all(axis=0)
        return tuple(np.flatnonzero(there).tolist())

    @property
    def deflection(self) -> FloatArray:
        """Real minus commanded TCP position, shape (reading, 3), in m (docs/conventions.md).

        ``deflection = marker_displacement - controller_displacement``: the paper's Eq. (10)
        and (13) with both signs turned. Of a reading that no tracker measured it is the deflection
        of the arm and of the contact together, since the tooling holds the tool.
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
        return replace(
            self,
            pose=self.pose[rows],
            load_case=self.load_case[rows],
            sequence=None if self.sequence is None else self.sequence[rows],
            contacts=None if self.contacts is None else self.contacts[rows],
            campaign=None if self.campaign is None else self.campaign[rows],
            **numbers,
        )

    def set_aside(self, index: ArrayLike) -> "Readings":
        """Return the readings without some whose presses remain in the history of friction.

        Parameters
        ----------
        index : array_like of bool, shape (reading,)
            Those to set aside.
        """
        aside = np.asarray(index, dtype=bool)
        if not np.any(aside):
            return self
        order = np.arange(len(self)) if self.sequence is None else self.sequence
        pressed = Presses(
            self.pose[aside],
            order[aside],
            self.joint_position[aside],
            self.force[aside],
            None if self.moment is None else self.moment[aside],
        )
        if self.also_pressed is not None:
            pressed = self.also_pressed.with_others(pressed)
        return replace(replace(self, sequence=order).take(~aside), also_pressed=pressed)

    def _numbers(self) -> Iterator[tuple[str, FloatArray]]:
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name not in _NO_NUMBERS and value is not None:
                yield field.name, value

    def _own(self, name: str, array: np.ndarray, shape: tuple[int, ...]) -> None:
        if array.shape != shape:
            raise DatasetError(f"{name} of the readings has shape {array.shape}, not {shape}")
        freeze(array)
        object.__setattr__(self, name, array)


def without(readings: Readings, excluded: str | Sequence[str]) -> Readings:
    """Return the readings without those named ``POSE`` or ``POSE:LOAD_CASE``.

    Their presses remain in the history of friction: see `Readings.set_aside`.

    Parameters
    ----------
    readings : Readings
        All of them.
    excluded : str or sequence of str
        One name, or several.

    Raises
    ------
    DatasetError
        If a name matches no reading, or none is left.
    """
    return readings.set_aside(excluded_rows(readings, excluded))


def excluded_rows(readings: Readings, excluded: str | Sequence[str]) -> BoolArray:
    """Return which readings are named ``POSE`` or ``POSE:LOAD_CASE``, shape (reading,).

    Parameters
    ----------
    readings, excluded
        As for `without`.

    Raises
    ------
    DatasetError
        If a name matches no reading, or none is left.
    """
    # A text is a sequence too: "12" would be the poses 1 and 2.
    names = (excluded,) if isinstance(excluded, str) else tuple(excluded)
    rows = np.zeros(len(readings), dtype=bool)
    for name in names:
        rows |= _named(readings, name)
    if np.all(rows):
        raise DatasetError(f"to exclude {', '.join(names)} leaves no reading")
    return rows


def _named(readings: Readings, name: str) -> BoolArray:
    pose, _, load_case = name.partition(":")
    try:
        mask = readings.pose == int(pose)
    except ValueError as error:
        raise DatasetError(f"excluded reading {name!r} must be POSE or POSE:LOAD_CASE") from error
    if not np.any(mask):
        raise DatasetError(f"excluded reading {name!r}: there is no usable reading at pose {pose}")
    if load_case:
        cases = sorted(set(readings.load_case[mask].tolist()))
        mask &= readings.load_case == load_case
        if not np.any(mask):
            raise DatasetError(
                f"excluded reading {name!r}: pose {pose} has no load case {load_case!r}"
                f"{nearest(load_case, cases)} (it has {', '.join(cases)})"
            )
    return np.asarray(mask)
