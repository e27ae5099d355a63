"""Readings, and the rows of their springs under other forces: what interpretations are made of.

Rows of springs are linear in the force. With the rows of three unit forces at each reading, a
rotated, exchanged or scaled force needs a product, not a new model.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, ModelPosture, bearing
from elastocal.identification.contact import Contact, compliance_columns
from elastocal.identification.displacement import Between, reference_joints
from elastocal.identification.mistakes.plausibility import sensor_frames
from elastocal.identification.options import FitOptions
from elastocal.identification.problem import Problem, build
from elastocal.identification.solve import fit_each, least_squares_left
from elastocal.identification.suspicious import screen
from elastocal.identification.uncertainty import HeldOut, leave_poses_out
from elastocal.robot import Robot

CLEAR, LIKELY, FITTED, IN_TIME = 0.9, 0.75, 0.85, 0.97
"""Part of the error that may be left: by forces and rows, by markers, by estimated numbers, by
those that grow in the order of poses, which no correct arm imitates."""
_HOPELESS = 2.0
"""Root mean square residual over that of the readings as stated above which others are hopeless:
what leaves twice as much in all does not leave clearly less in nine tenths of the rows."""
_ROUND_OFF = 1e-3
"""Part of the deflections below which what is left may be round-off."""
AT_ONCE = 16
"""Problems that are fitted at once: each alone is mostly overhead, and all take memory."""
PARTS = (0.33, 0.5, 0.67)
"""Parts of a campaign after which it may have been mistaken, or no longer."""
_TRACKER = FitOptions(encoders=False)
"""Secondary encoders are left out: they would hide a force or a frame that was read otherwise."""
_TRIMMED = 0.9
"""Part of the readings, those with the smallest residuals, that rank readings of the data."""


@dataclass(frozen=True)
class OtherReading:
    """An interpretation of the data, with the mistake that it undoes."""

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
    """Factor by which the noise of the marker is reduced."""
    estimated: bool = False
    """Whether numbers were estimated for it, which explain part of what the springs miss."""
    cause: str = ""
    """Same text in all interpretations of one cause, of which the plainest is told; empty: none."""


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
    place: FloatArray
    """Marker in the tcp frame, shape (3,), in m."""
    kept: BoolArray
    """Readings that are no blunders, shape (reading,)."""

    @classmethod
    def of(
        cls,
        robot: Robot,
        readings: Readings,
        marker_offset: ArrayLike | None,
        contact: Contact | None = None,
    ) -> "Rows":
        """Return the rows of readings, of the arm with the springs of its bearings.

        Columns of a contact that holds the tool follow; what its rows share is small beside what
        mistakes change, and is left out.
        """
        model = ElasticModel(robot, bearing(robot))
        zero = reference_joints(robot, readings)
        readings = replace(readings, reference_joint_position=zero)
        options = replace(_TRACKER, contact=contact)
        problem = replace(build(model, readings, options, marker_offset), shared=None)
        R = robot.forward(readings.joint_position)[:, :3, :3]
        at, before = model.at(readings.joint_position), model.at(zero)

        def unit(posture: ModelPosture) -> FloatArray:
            shape = readings.force.shape
            each = []
            for axis in np.eye(3):
                e = np.broadcast_to(axis, shape)
                springs = model.observation_blocks(posture, e, marker_offset=marker_offset)
                held = compliance_columns(R, e, readings.disks)[:, :, : len(problem.contact)]
                each.append(np.concatenate([springs, held], axis=2))
            return np.stack(each, axis=2)

        light = readings.reference_force
        reference = unit(before) if light is not None else np.zeros(0)
        kept = ~screen(problem).blunder
        place = np.zeros(3) if marker_offset is None else np.asarray(marker_offset, dtype=float)
        bare = cls(model, readings, problem, unit(at), reference, np.zeros(1), place, kept)
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

    def moved(self, force: FloatArray, compliance: FloatArray) -> FloatArray:
        """Return how forces, shape (reading, 3, force), bend springs of compliances, in m."""
        return np.asarray(np.einsum("rikn,n->rik", self.basis, compliance) @ force)

    @cached_property
    def frames(self) -> dict[str, FloatArray]:
        """See `sensor_frames`."""
        return sensor_frames(self.model.robot, self.readings.joint_position)

    @cached_property
    def lever(self) -> FloatArray:
        """Rows per metre by which the marker sits elsewhere along each axis of the tcp frame.

        Shape (reading, 3, axis, spring).
        """
        between, n = Between.of(self.model, self.readings), self.problem.springs
        found = np.zeros((*self.problem.O.shape[:2], 3, self.problem.columns))
        for axis, e in enumerate(np.eye(3)):
            found[:, :, axis, n] = between.of_point(self.place + e) - self.problem.O[:, :, n]
        return found

    @cached_property
    def stated(self) -> Problem:
        """The problem of the kept rows, read as stated."""
        return self.without_blunders(self.problem)

    @cached_property
    def compliance(self) -> FloatArray:
        """Compliances of the readings as stated, shape (spring,)."""
        return fitted(self.stated)

    @cached_property
    def residual(self) -> FloatArray:
        """Norms of what they leave, shape (kept reading,), in m."""
        return np.asarray(np.linalg.norm(self.stated.residuals(self.compliance), axis=1))

    @cached_property
    def held_out(self) -> HeldOut:
        """Refits of the readings as stated without each pose."""
        return leave_poses_out(self.stated)

    def without_blunders(self, problem: Problem) -> Problem:
        """Return a problem of all readings without those that are blunders."""
        return problem if self.kept.all() else problem.take(self.kept)

    def read(self, reading: OtherReading) -> Problem:
        """Return the problem of the kept rows, read otherwise."""
        return self.without_blunders(replace(self.problem, O=reading.blocks, d=reading.d))

    def is_possible(self, grams: FloatArray) -> BoolArray:
        """Return which Gram matrices of ``[O d]`` some values of the springs may explain.

        The others leave far more than the readings as stated do, whatever the springs
        (`_HOPELESS`): a bounded fit need not say so. Shape (fit,).
        """
        most = _HOPELESS**2 * float(self.residual @ self.residual)
        left = least_squares_left(grams, self.problem.size)
        return np.asarray(left <= most + _ROUND_OFF**2 * grams[:, -1, -1])


def fitted(problem: Problem) -> FloatArray:
    """Return the bounded compliances of a problem by one Gram matrix, which is quick."""
    return np.asarray(fit_each([problem])[0])


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
        prior_rows=np.insert(problem.prior_rows, [problem.columns] * count, 0.0, axis=1),
        size=np.concatenate([np.broadcast_to(problem.size, problem.lower.shape), size]),
    )


def residuals(problems: Iterable[Problem]) -> Iterator[float]:
    """Yield the trimmed mean residual of the fit of each problem of a shape, in m."""
    remaining = iter(problems)
    while part := list(islice(remaining, AT_ONCE)):
        for problem, compliance in zip(part, fit_each(part), strict=True):
            yield trimmed(np.linalg.norm(problem.residuals(compliance), axis=1))


def first_of_pose(r: Readings) -> IndexArray:
    """Return the number of the first reading of each reading's pose, shape (reading,)."""
    begins = np.flatnonzero(begins_pose(r))
    return begins[np.searchsorted(begins, np.arange(len(r)), side="right") - 1]


def begins_pose(r: Readings) -> BoolArray:
    """Return whether a reading is the first of its pose, shape (reading,)."""
    return np.append(True, r.pose[1:] != r.pose[:-1])


def trimmed(norms: FloatArray) -> float:
    """Return the mean of the smallest residuals."""
    return float(np.sort(norms)[: max(1, int(_TRIMMED * len(norms)))].mean())
