"""Readings of the data otherwise than stated: rows of springs, linear in the force.

With the rows of three unit forces at each reading, a force that is turned, exchanged or scaled
costs a product, not a new model. What is a number, such as a constant in the force or a drift, is
estimated beside the springs.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray, FloatArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, ModelPosture, bearing
from elastocal.identification.displacement import reference_joints
from elastocal.identification.problem import Problem, build
from elastocal.identification.solve import PoseGrams
from elastocal.identification.suspicious import screen
from elastocal.robot import Robot

_PARALLEL = 0.02
"""Largest element by which axes of parallel frames differ."""


@dataclass(frozen=True)
class OtherReading:
    """A way of reading the data, with the mistake that it undoes."""

    message: str
    blocks: FloatArray
    """Rows of the springs, shape (reading, 3, spring), in m per unit of each."""
    d: FloatArray
    """Deflections, shape (reading, 3), in m."""
    least: float
    """Part of the error that may be left for the mistake to be named."""
    certain: bool = False
    """Whether data are refused for it where nothing else explains them as well."""
    louder: float = 1.0
    """By how much the noise of the marker is made smaller."""
    estimated: bool = False
    """Whether numbers were estimated for it, which explain part of what the springs miss."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Readings, with the rows of their springs under a unit force along each axis of base."""

    model: ElasticModel
    readings: Readings
    problem: Problem
    basis: FloatArray
    """Shape (reading, 3, axis, spring), in m per N and unit of each spring."""
    reference: FloatArray
    """The same at the joints of the reference."""
    rest: FloatArray
    """Rows of what no force makes: moments and the arm's weight, shape (reading, 3, spring)."""
    lever: FloatArray
    """Rows per metre by which the marker sits elsewhere along each axis of the tcp frame, shape
    (reading, 3, axis, spring)."""
    kept: BoolArray
    """Readings that are no blunders, shape (reading,)."""

    @classmethod
    def of(cls, robot: Robot, readings: Readings, marker_offset: ArrayLike | None) -> "Rows":
        model = ElasticModel(robot, bearing(robot))
        zero = reference_joints(robot, readings)
        readings = replace(readings, reference_joint_position=zero)
        problem = build(model, readings, None, marker_offset)
        at, before = model.at(readings.joint_position), model.at(zero)

        def unit(posture: ModelPosture) -> FloatArray:
            shape = readings.force.shape
            each = [
                model.observation_blocks(
                    posture, np.broadcast_to(e, shape), marker_offset=marker_offset
                )
                for e in np.eye(3)
            ]
            return np.stack(each, axis=2)

        light = readings.reference_force
        reference = unit(before) if light is not None else np.zeros(0)
        kept = ~screen(problem).blunder
        place = np.zeros(3) if marker_offset is None else np.asarray(marker_offset, dtype=float)
        moved = [build(model, readings, None, place + e).O - problem.O for e in np.eye(3)]
        lever = np.stack(moved, axis=2)
        bare = cls(model, readings, problem, unit(at), reference, np.zeros(1), lever, kept)
        return replace(bare, rest=problem.O - bare.blocks(readings.force, light))

    def blocks(self, force: FloatArray, light: FloatArray | None) -> FloatArray:
        """Return the rows of other forces under load and at the reference, each (reading, 3)."""
        made: FloatArray = np.einsum("rikn,rk->rin", self.basis, force)
        if light is not None:
            made -= np.einsum("rikn,rk->rin", self.reference, light)
        return made + self.rest

    def turned(self, G: FloatArray) -> FloatArray:
        """Return the rows of forces that matrices, shape (reading, 3, 3), make of those stated."""
        force, light = self.readings.force, self.readings.reference_force
        return self.blocks(
            np.einsum("rij,rj->ri", G, force),
            None if light is None else np.einsum("rij,rj->ri", G, light),
        )

    @cached_property
    def frames(self) -> dict[str, FloatArray]:
        """Axes of the frames that a sensor may have, in base, shape (reading, 3, 3)."""
        robot = self.model.robot
        R = robot.forward(self.readings.joint_position)[:, :3, :3]
        last = robot.chain.T_last_tip[:3, :3]
        found = {"tcp": R, "base": np.broadcast_to(np.eye(3), R.shape)}
        # Axes that lie along those of the tcp, in whatever order, are among its other readings.
        if not np.allclose(np.abs(last).max(axis=0), 1.0, atol=_PARALLEL):
            found["last link"] = R @ last.T
        return found

    def read(self, reading: OtherReading) -> Problem:
        return replace(self.problem, O=reading.blocks, d=reading.d).take(self.kept)


def fitted(problem: Problem) -> FloatArray:
    """Return the bounded compliances of a problem by one Gram matrix, which is quick."""
    whole = replace(problem, block=np.zeros_like(problem.block))
    return np.asarray(PoseGrams.of(whole).refit(np.ones((1, 1)))[0])


def beside(problem: Problem, columns: FloatArray) -> Problem:
    """Return a problem with free columns beside those of the springs."""
    count = columns.shape[2]
    free = np.full(count, np.inf)
    norm = np.linalg.norm(problem.O.reshape(-1, problem.columns) * problem.size, axis=0).max()
    own = np.linalg.norm(columns.reshape(-1, count), axis=0)
    size = norm / np.where(own > 0.0, own, 1.0)
    return replace(
        problem,
        O=np.concatenate([problem.O, columns], axis=2),
        lower=np.concatenate([problem.lower, -free]),
        upper=np.concatenate([problem.upper, free]),
        prior_rows=np.zeros((0, problem.columns + count + 1)),
        size=np.concatenate([np.broadcast_to(problem.size, problem.lower.shape), size]),
    )


def apart(problem: Problem, late: BoolArray) -> Problem:
    """Return a problem with springs of their own for late readings, shape (reading,)."""

    def twice(values: FloatArray | float) -> FloatArray:
        return np.tile(np.broadcast_to(values, problem.lower.shape), 2)

    part = late[:, None, None]
    return replace(
        problem,
        O=np.concatenate([np.where(part, 0.0, problem.O), np.where(part, problem.O, 0.0)], axis=2),
        lower=twice(problem.lower),
        upper=twice(problem.upper),
        prior_rows=np.zeros((0, 2 * problem.columns + 1)),
        size=twice(problem.size),
    )
