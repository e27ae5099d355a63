"""A serial chain as data, and the Pinocchio model made from it.

Both the rigid robot and the elastic one are the same chain; the elastic one has springs
inserted as additional joints, before or after the joint they belong to.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from elastocal.arrays import FloatArray, IndexArray
from elastocal.results import brief_repr
from elastocal.wording import phrase

_STRAIGHT = 0.02
"""Largest tilt in rad of a tip that is taken to point out of the arm."""
_NEAR = 1e-4
"""Distance in m along the last axis below which the outward direction of the arm is
undetermined."""


@brief_repr
@dataclass(frozen=True)
class ChainJoint:
    """One movable joint, with everything that is rigidly fixed behind it."""

    name: str
    revolute: bool
    """True for a revolute joint, False for a prismatic one."""
    axis: FloatArray
    """Unit vector of the joint axis in the joint frame, shape (3,)."""
    placement: FloatArray
    """T_parent_joint: joint frame at zero in the previous joint's frame, shape (4, 4)."""
    lower: float
    """Lower position limit in rad or m; -inf if there is none."""
    upper: float
    """Upper position limit in rad or m; inf if there is none."""
    velocity: float
    """Largest velocity in rad/s or m/s; NaN when not known."""
    effort: float
    """Largest torque in N·m or force in N; NaN when not known."""
    mass: float
    """Mass in kg of the links behind the joint; 0 when not known."""
    centre_of_mass: FloatArray
    """Centre of that mass in the joint frame, shape (3,), in m."""


@dataclass(frozen=True)
class SerialChain:
    """Joints from a base link to a tip link."""

    joints: tuple[ChainJoint, ...]
    base: str
    tip: str
    T_last_tip: FloatArray
    """Tip frame in the last joint's moving frame, shape (4, 4)."""

    def __repr__(self) -> str:
        return f"{len(self.joints)} joints from {self.base!r} to {self.tip!r}"

    @property
    def tip_tilt(self) -> float:
        """Angle in rad between the tip's z axis and the outward direction of the last axis.

        0 is a tip from which a tool points straight on; π/2 one whose z axis lies across, as that
        of ROS-Industrial's ``flange``, whose x axis points out. NaN if the last joint slides.
        """
        last = self.joints[-1]
        if not last.revolute:
            return math.nan
        before = -last.placement[:3, :3].T @ last.placement[:3, 3]
        along = last.axis @ (self.T_last_tip[:3, 3] - before)
        cosine = float(self.T_last_tip[:3, 2] @ last.axis)
        straight = abs(cosine) if abs(along) < _NEAR else cosine * math.copysign(1.0, along)
        return math.acos(min(1.0, max(-1.0, straight)))

    @property
    def points_out(self) -> bool:
        """Whether the tip's z axis points straight out of the arm."""
        return self.tip_tilt < _STRAIGHT

    @property
    def tip_direction(self) -> str:
        """Direction of the tip's z axis, in words."""
        tilt, last = self.tip_tilt, self.joints[-1].name
        if math.isnan(tilt):
            return f"behind {last}, which slides"
        if self.points_out:
            return f"out of the arm, along {last}"
        return f"{math.degrees(tilt):.0f} deg off the way out of the arm along {last}"

    @property
    def weight_gap(self) -> str:
        """Why the arm's own weight is not known, in words; empty where it is.

        The last joint carries the tool, whose mass says nothing of the arm. Exporters that know no
        centre of mass write the origin of the link.
        """
        *arm, last = self.joints
        heavy = [joint for joint in arm if joint.mass > 0.0]
        if len(heavy) > 1 and not any(np.any(joint.centre_of_mass) for joint in heavy):
            return phrase("the centre of mass of every link is written at its joint, as on no arm")
        if heavy:
            return ""
        return phrase(
            "only what the last joint carries has a mass" if last.mass else "no link has a mass"
        )


@brief_repr
@dataclass(frozen=True)
class InsertedJoint:
    """A virtual joint, always at zero, that a spring acts about."""

    name: str
    parent: int
    """Index of the joint of the chain that it is inserted at."""
    axis: FloatArray
    """Unit vector in that joint's frame, shape (3,)."""
    revolute: bool
    distal: bool
    """True: in the moving frame, behind the joint's own motion. False: before it."""
    offset: FloatArray
    """Point of that frame that the axis passes through, shape (3,), in m."""


@dataclass(frozen=True)
class ChainModel:
    """A Pinocchio model of a chain, with where to find the columns of its Jacobians."""

    model: pin.Model
    tip_frame: int
    joint_columns: IndexArray
    """Column of each joint of the chain, shape (joint,)."""
    inserted_columns: IndexArray
    """Column of each inserted joint, in the order given, shape (inserted,)."""

    def __repr__(self) -> str:
        joints, inserted = len(self.joint_columns), len(self.inserted_columns)
        return f"ChainModel({joints} joints, {inserted} inserted)"


def build_model(chain: SerialChain, inserted: Sequence[InsertedJoint] = ()) -> ChainModel:
    """Return the Pinocchio model of a chain with virtual joints inserted.

    Continuous joints become revolute ones without limits, so that a configuration always has
    one number a joint.
    """
    model = pin.Model()
    joint_columns: list[int] = []
    column_of: dict[str, int] = {}
    parent = 0
    # What follows a joint, in its moving frame; a distal spring with an offset shifts it.
    behind = pin.SE3.Identity()
    for index, joint in enumerate(chain.joints):
        here = [virtual for virtual in inserted if virtual.parent == index]
        placement = behind * pin.SE3(joint.placement)
        for virtual in (v for v in here if not v.distal):
            parent, placement = _insert(model, parent, virtual, placement)
            column_of[virtual.name] = model.idx_vs[parent]
        parent = _add(model, parent, joint.revolute, joint.axis, placement, joint.name)
        joint_columns.append(model.idx_vs[parent])
        behind = pin.SE3.Identity()
        for virtual in (v for v in here if v.distal):
            parent, behind = _insert(model, parent, virtual, behind)
            column_of[virtual.name] = model.idx_vs[parent]
        # Fixed links need no inertia tensor, which is wrong in many URDFs.
        body = pin.Inertia(joint.mass, joint.centre_of_mass, np.zeros((3, 3)))
        model.appendBodyToJoint(parent, body, behind)
    T_last_tip = behind * pin.SE3(chain.T_last_tip)
    tip = model.addFrame(pin.Frame(chain.tip, parent, T_last_tip, pin.FrameType.OP_FRAME))
    return ChainModel(
        model,
        tip,
        np.array(joint_columns, dtype=np.intp),
        np.array([column_of[virtual.name] for virtual in inserted], dtype=np.intp),
    )


def _insert(
    model: pin.Model, parent: int, virtual: InsertedJoint, at: pin.SE3
) -> tuple[int, pin.SE3]:
    """Add a virtual joint and return it with the frame that follows, undisplaced."""
    shift = pin.SE3(np.eye(3), virtual.offset)
    joint = _add(model, parent, virtual.revolute, virtual.axis, at * shift, virtual.name)
    return joint, shift.inverse()


def _add(
    model: pin.Model, parent: int, revolute: bool, axis: FloatArray, at: pin.SE3, name: str
) -> int:
    kind = pin.JointModelRevoluteUnaligned if revolute else pin.JointModelPrismaticUnaligned
    return int(model.addJoint(parent, kind(np.asarray(axis)), at, name))
