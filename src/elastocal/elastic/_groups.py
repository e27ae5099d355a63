"""Springs of one law, evaluated together, and the chain that their axes are inserted into."""

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.elastic.springs import Spring, SpringLoad
from elastocal.robot import ChainModel, InsertedJoint, Robot, build_model

Columns = IndexArray | slice
"""Columns of an array; those that lie side by side as a slice, which copies nothing."""


@dataclass(frozen=True, eq=False)
class AlikeSprings:
    """Springs that share a law and so are evaluated together."""

    law: Spring
    """One of them."""
    axes: tuple[Columns, ...]
    """For each axis of the law, the column of the Jacobian of each spring."""
    parameters: tuple[Columns, ...]
    """For each parameter of the law, its place in the compliance vector for each spring."""
    friction: tuple[Columns, ...]
    """For each friction element of the law, its place among all for each spring."""

    def load(
        self,
        torque: FloatArray,
        weight: FloatArray | None = None,
        friction: FloatArray | None = None,
    ) -> SpringLoad[FloatArray]:
        """Return the loads of these springs.

        Of torques of load and weight of shape (..., axis), friction of shape (..., element).
        """
        return SpringLoad(
            tuple(torque[..., axis] for axis in self.axes),
            () if weight is None else tuple(weight[..., axis] for axis in self.axes),
            () if friction is None else tuple(friction[..., place] for place in self.friction),
        )


def insert_springs(robot: Robot, springs: Sequence[Spring]) -> tuple[ChainModel, IndexArray]:
    """Build the chain and find the column of each axis; axial ones share that of the joint."""
    joints = {joint.name: index for index, joint in enumerate(robot.chain.joints)}
    axes = [axis for spring in springs for axis in spring.axes]
    own = [axis.is_axis_of(robot.chain.joints[joints[axis.joint]]) for axis in axes]
    inserted = [
        InsertedJoint(
            axis.name,
            joints[axis.joint],
            np.array(axis.axis),
            axis.revolute,
            axis.distal,
            np.array(axis.offset),
        )
        for axis, shares in zip(axes, own, strict=True)
        if not shares
    ]
    chain = build_model(robot.chain, inserted)
    virtual = iter(chain.inserted_columns)
    columns = [
        chain.joint_columns[joints[axis.joint]] if shares else next(virtual)
        for axis, shares in zip(axes, own, strict=True)
    ]
    return chain, np.array(columns, dtype=np.intp)


def group_alike(springs: Sequence[Spring]) -> Iterator[AlikeSprings]:
    """Group springs by their law."""
    members: dict[Hashable, list[int]] = {}
    for index, spring in enumerate(springs):
        members.setdefault(spring.law, []).append(index)
    first_axis = np.cumsum([0, *(len(spring.axes) for spring in springs)])
    first_parameter = np.cumsum([0, *(len(spring.parameters) for spring in springs)])
    first_element = np.cumsum([0, *(len(spring.friction_limits) for spring in springs)])
    for indices in members.values():
        law = springs[indices[0]]
        yield AlikeSprings(
            law,
            tuple(_side_by_side(first_axis[indices] + k) for k in range(len(law.axes))),
            tuple(_side_by_side(first_parameter[indices] + k) for k in range(len(law.parameters))),
            tuple(
                _side_by_side(first_element[indices] + k) for k in range(len(law.friction_limits))
            ),
        )


def assembled(columns: Sequence[FloatArray], places: Sequence[Columns]) -> FloatArray:
    """Return columns of shape (..., 3, spring) as one array, each group at its places."""
    n = sum(column.shape[-1] for column in columns)
    blocks = np.empty((*columns[0].shape[:-1], n))
    for place, column in zip(places, columns, strict=True):
        blocks[..., place] = column
    return blocks


def _side_by_side(columns: IndexArray) -> Columns:
    start, stop = int(columns[0]), int(columns[-1]) + 1
    return slice(start, stop) if np.array_equal(columns, np.arange(start, stop)) else columns
