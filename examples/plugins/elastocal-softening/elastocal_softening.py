"""A bolted joint of a robot: it gapes under load, so that it yields the more, the larger that is.

In a spring file::

    schema: elastocal.springs/1
    include: bearing
    springs:
      - {joint: joint_a2, axis: x, kind: softening}
"""

from typing import ClassVar, Literal

from elastocal.elastic import OneAxisSpring, Parameter, SpringLoad, Unit
from elastocal.records import record

COMPLIANCE = Unit("rad/(N*m)", "µrad/(N·m)", 1e6, "MN·m/rad")


@record()
class Softening(OneAxisSpring):
    """A spring with ``theta = c_0 t + c_1 t^3 / T^2``."""

    opening: float = 1000.0
    """``T``: torque at which the joint begins to gape, in N·m."""
    kind: Literal["softening"] = "softening"
    units: ClassVar[tuple[Unit, ...]] = (COMPLIANCE,)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """``c_0`` and ``c_1``, in rad/(N·m)."""
        return tuple(
            Parameter(f"{self.name}.{name}", self.joint, COMPLIANCE, 1e-6)
            for name in ("closed", "open")
        )

    def angles(self, load: SpringLoad):
        """Return the law: the angle for one unit of each parameter."""
        (t,) = load.torque
        return ((t, t * t * t / (self.opening * self.opening)),)

    def tangents(self, load: SpringLoad):
        """Return the derivative of the law by the torque."""
        (t,) = load.torque
        return (((1.0, 3.0 * t * t / self.opening**2),),)
