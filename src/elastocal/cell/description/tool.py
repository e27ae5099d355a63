"""What hangs on the flange: calibration tool and force sensor."""

from elastocal.arrays import FloatArray
from elastocal.cell.description.pose import IDENTITY, Pose, vector
from elastocal.cell.description.quantities import Mass, Point, PositiveForce, PositiveMoment
from elastocal.cell.description.shapes import Shape
from elastocal.records import StrictModel


class Tool(StrictModel):
    """Everything behind the flange, in the flange frame."""

    mass: Mass
    """Of all of it, in kg."""
    centre_of_mass: Point = (0.0, 0.0, 0.0)
    """In the flange frame, in m."""
    shapes: tuple[Shape, ...] = ()
    """Solids that must not touch anything, in the flange frame."""

    @property
    def centre(self) -> FloatArray:
        """Centre of mass in the flange frame, shape (3,), in m."""
        return vector(self.centre_of_mass)


class ForceSensor(StrictModel):
    """A force/torque sensor between flange and tool."""

    name: str = ""
    pose: Pose = IDENTITY
    """Of its measuring frame in the flange frame."""
    force_range: tuple[PositiveForce, PositiveForce, PositiveForce]
    """Largest force along each of its axes, in N."""
    moment_range: tuple[PositiveMoment, PositiveMoment, PositiveMoment]
    """Largest moment about each of its axes, in N·m."""

    @property
    def T_flange_sensor(self) -> FloatArray:
        """Measuring frame in the flange frame, shape (4, 4)."""
        return self.pose.T

    @property
    def largest_force(self) -> FloatArray:
        """Shape (3,), in N."""
        return vector(self.force_range)

    @property
    def largest_moment(self) -> FloatArray:
        """Shape (3,), in N·m."""
        return vector(self.moment_range)
