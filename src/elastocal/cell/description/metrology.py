"""Laser trackers, and the marker near the contact that they look at."""

from elastocal.arrays import FloatArray
from elastocal.cell.description.pose import unit_vector, vector
from elastocal.cell.description.quantities import Direction, Point, PositiveAngle, Range
from elastocal.records import StrictModel


class Tracker(StrictModel):
    """One station: where a tracker stands."""

    name: str
    position: Point
    """Of its beam's origin in base, in m; a rough value will do."""
    range: Range
    """Nearest and farthest marker that it measures, in m."""

    @property
    def position_base(self) -> FloatArray:
        """Shape (3,), in m."""
        return vector(self.position)


class Marker(StrictModel):
    """A reflector or a 6D probe on the tool."""

    position: Point
    """In the tcp frame, in m."""
    axis: Direction
    """Direction that it looks in, in the tcp frame."""
    acceptance: PositiveAngle
    """Largest angle between that axis and the beam, in rad."""

    @property
    def position_tcp(self) -> FloatArray:
        """Shape (3,), in m."""
        return vector(self.position)

    @property
    def axis_tcp(self) -> FloatArray:
        """Unit vector, shape (3,)."""
        return unit_vector(self.axis)
