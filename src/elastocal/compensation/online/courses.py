"""The beginnings of courses on a real cell: when one begins, and what the marker shows there.

Nobody has to announce a course. The tool was free, it has pressed, and now it stands still in light
contact: it is at the start of one. The marker ``p`` of a tracker that stands at ``T_base_tracker``
is averaged there; with the controller's tool frame at ``(x, R)``, the marker ``r`` in it, and the
reading ``a`` that was taken at that place, in the air, when the path was taught,

    d = T_base_tracker p - (x + R r) - a

is what `elastocal.compensation.online.Compensator.begin_course` takes. A place that nobody taught
is taught by the first landing there: the tool is read where it stands in the air before it lands.
"""

from dataclasses import dataclass, replace

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import PointBlock
from elastocal.compensation.online.live import LiveCycle
from elastocal.compensation.online.state import Status, Triple
from elastocal.results import brief_repr
from elastocal.robot import Robot

_FREE, _LIGHT, _PRESSED = 0.3, 2.0, 3.0
"""Forces over that of the light contact: free below the first, light up to the second, pressed from
the third on."""
_STILL = 50e-6
"""Way of the tool that is still standing, in m: the correction itself may still arrive."""
_NEAR = 0.03
"""Distance from a taught place that is still that place, in m."""
_LEAST = 5
"""Fewer samples of the marker make no reading."""
_UNKNOWN = Status.FADED.value
"""A cycle that is held between two readings of a slower sensor tells nothing new, and takes nothing
away."""


@brief_repr
@dataclass(frozen=True, eq=False)
class TaughtCourses:
    """Readings of marker and controller at the places where courses begin, from teaching."""

    place: FloatArray
    """Tool centre points by the controller, in base, shape (place, 3), in m; none: (0, 3)."""
    offset: FloatArray
    """Marker less controller there, in the air, in base, shape (place, 3), in m."""
    T_base_tracker: FloatArray
    """Shape (4, 4)."""
    station: str
    """Station that measured, and measures again."""
    lever: FloatArray
    """Marker in the tcp frame, shape (3,), in m."""

    def near(self, place: FloatArray) -> FloatArray | None:
        """Return the offset that was taught at the nearest place, (3,); None: none is near."""
        away = np.linalg.norm(self.place - place, axis=1)
        return self.offset[np.argmin(away)] if (away <= _NEAR).any() else None

    def seen(self, T_base_tcp: FloatArray, marker: FloatArray) -> FloatArray:
        """Return marker less controller, in base, (3,), of positions of the marker (sample, 3)."""
        R, p = self.T_base_tracker[:3, :3], self.T_base_tracker[:3, 3]
        believed = T_base_tcp[:3, 3] + T_base_tcp[:3, :3] @ self.lever
        seen: FloatArray = p + R @ marker.mean(axis=0) - believed
        return seen

    def teach(self, place: FloatArray, offset: FloatArray) -> "TaughtCourses":
        """Return the same with a place more."""
        return replace(
            self, place=np.vstack([self.place, place]), offset=np.vstack([self.offset, offset])
        )


@dataclass(frozen=True)
class LightContact:
    """How the light contact at the start of a course is known, and read."""

    force: float
    """In N."""
    settle: float
    """Time that the tool stands in it before it is read, in s."""
    average: float
    """Time over which it is read, in s."""
    scatter: float
    """Largest standard deviation of the marker meanwhile, each axis, in m."""


class CourseWatch:
    """Sees courses begin and end; outside the thread of the loop, which must not wait for it.

    Parameters
    ----------
    robot : Robot
        As the controller knows it.
    taught : TaughtCourses
        Where courses begin, as far as that was taught.
    contact : LightContact
        How a course begins.
    """

    def __init__(self, robot: Robot, taught: TaughtCourses, contact: LightContact) -> None:
        self._robot, self.taught, self._contact = robot, taught, contact
        self.refusal = ""
        """Why the last beginning gave no reading; empty: it gave one."""
        self._pressed = False
        self._free_since: float | None = None
        self._air: tuple[FloatArray, FloatArray] | None = None
        """Where the tool last stood in the air, and marker less controller there."""
        self._still_since: float | None = None
        self._still_at = np.zeros(3)
        self._points: list[PointBlock] = []

    def see(self, cycle: LiveCycle, points: PointBlock | None) -> Triple | None:
        """Return what marker and controller show, once in each course; None: no course begins now.

        Parameters
        ----------
        cycle : LiveCycle
            The newest.
        points : PointBlock or None
            What the tracker has measured since the last call; None: it did not answer.
        """
        force = float(np.linalg.norm(cycle.wrench[:3])) / self._contact.force
        if cycle.status & _UNKNOWN:
            # What the tool does is not known: it may have left.
            self._pressed, self._still_since, self._free_since = False, None, None
            return None
        free, pressed = force < _FREE, force >= _PRESSED
        if free != (self._free_since is not None):
            # What was read in the air is no reading in contact.
            self._free_since, self._still_since = cycle.time if free else None, None
        self._pressed = pressed or (self._pressed and not self.is_free(cycle))
        if not free and not (self._pressed and force <= _LIGHT):
            self._still_since = None
            return None
        found = self._stood(cycle, points)
        if found is None:
            return None
        T, marker = found
        if not free:
            return self._deviation(T, marker)
        if not self._unusable(marker):
            self._air = T[:3, 3], self.taught.seen(T, marker)
        return None

    def is_free(self, cycle: LiveCycle) -> bool:
        """Return whether the tool has touched nothing for some time: its course is over."""
        since = self._free_since
        return since is not None and cycle.time - since >= self._contact.settle

    def _stood(
        self, cycle: LiveCycle, points: PointBlock | None
    ) -> tuple[FloatArray, FloatArray] | None:
        """Return tool frame and positions of the marker where the tool has stood long enough."""
        contact, T = self._contact, self._robot.forward(np.array(cycle.q))
        if self._still_since is None or np.linalg.norm(T[:3, 3] - self._still_at) > _STILL:
            self._still_since, self._still_at, self._points = cycle.time, T[:3, 3], []
        if points is not None:
            self._points.append(points)
        begins = self._still_since + contact.settle
        if cycle.time < begins + contact.average:
            return None
        samples, self._points, self._still_since = self._points, [], None
        return T, _between(samples, self.taught.station, begins, cycle.time)

    def _deviation(self, T_base_tcp: FloatArray, marker: FloatArray) -> Triple | None:
        """Return the reading of a beginning from positions of the marker, (sample, 3)."""
        # One reading a course: the next needs another press.
        self._pressed, x, air = False, T_base_tcp[:3, 3], self._air
        self.refusal = self._unusable(marker)
        if not self.refusal and self.taught.near(x) is None:
            if air is None or not np.linalg.norm(air[0] - x) <= _NEAR:
                self.refusal = (
                    f"no place within {1e3 * _NEAR:.0f} mm was taught, and the tool did not stand"
                    " in the air before it landed"
                )
            else:
                self.taught = self.taught.teach(x, air[1])
        taught = self.taught.near(x)
        if self.refusal or taught is None:
            return None
        dx, dy, dz = (self.taught.seen(T_base_tcp, marker) - taught).tolist()
        return dx, dy, dz

    def _unusable(self, marker: FloatArray) -> str:
        """Return why positions of the marker make no reading; empty: they do."""
        if len(marker) < _LEAST:
            return f"the tracker gave {len(marker)} positions: at least {_LEAST} are needed"
        scatter = float(marker.std(axis=0).max())
        if not scatter <= self._contact.scatter:
            return f"the marker scattered by {1e3 * scatter:.3f} mm: it did not stand still"
        return ""


def _between(blocks: list[PointBlock], station: str, begin: float, end: float) -> FloatArray:
    """Return the finite positions that a station measured in a time, shape (sample, 3), in m."""
    own = [block for block in blocks if block.station == station]
    if not own:
        return np.zeros((0, 3))
    time = np.concatenate([block.time for block in own])
    position = np.concatenate([block.position for block in own])
    inside = (time >= begin) & (time <= end) & np.isfinite(position).all(axis=1)
    finite: FloatArray = position[inside]
    return finite
