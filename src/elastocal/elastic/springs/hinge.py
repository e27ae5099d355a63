"""Hinge: a linear spring about an axis, or along one."""

from elastocal.arrays import FloatArray
from elastocal.elastic.springs.expression import Quantity
from elastocal.elastic.springs.spring import (
    Angles,
    OneAxisSpring,
    Parameter,
    SpringLoad,
    Tangents,
    Unit,
    as_axis,
)
from elastocal.records import record
from elastocal.robot import ChainJoint

_TORSIONAL = Unit("rad/(N*m)", "µrad/(N·m)", 1e6, "MN·m/rad")
_LINEAR = Unit("m/N", "µm/N", 1e6, "MN/m")
_SCALE = 1e-6
"""A gear of a heavy arm yields about a microradian to a newton metre, a soft guideway a micrometre
to a newton."""


@record()
class Hinge(OneAxisSpring):
    """A virtual joint that yields in proportion to its load: ``theta = c t`` (paper Eq. 10)."""

    units = (_TORSIONAL, _LINEAR)

    @property
    def kind(self) -> str:
        """``revolute`` or ``prismatic``."""
        return "revolute" if self.revolute else "prismatic"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """One compliance, in rad/(N·m) or m/N."""
        unit = _TORSIONAL if self.revolute else _LINEAR
        return (Parameter(self.name, self.joint, unit, _SCALE),)

    def angles(self, load: SpringLoad[Quantity]) -> Angles[Quantity]:
        """Return the load torque itself."""
        return ((load.torque[0],),)

    def tangents(self, load: SpringLoad[FloatArray]) -> Tangents:
        """Return 1: the tangent is the compliance, whatever the load."""
        del load
        return (((1.0,),),)


def axial(joint: ChainJoint) -> Hinge:
    """Return the spring about (or along) a joint's own axis: gear, servo, belt."""
    return Hinge(f"{joint.name}.axial", joint.name, as_axis(joint.axis), joint.revolute)
