"""Where the tip of a campaign without a tracker is, found beside the springs.

A tip that is clamped by hand is some millimetres from where the description has it. Every lever of
the arm ends there, so that the deflection ``O(q, f; r) c`` depends on its place ``r`` as well as on
the compliances. The loads have one of each to find, and both are fitted in turn (Gauss-Newton):

    O(q, f; r + s) c = O(q, f; r) c + (d/dr O(q, f; r) c) s

with a normal prior of the stated width about the place that the description has. The springs can
take up most of a shift along the normal: what is then found there is the place that explains the
presses best, whatever the springs lack included. See docs/decisions/0137-place-of-the-tip.md.
"""

from dataclasses import replace

import numpy as np

from elastocal.arrays import FloatArray, triple
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.errors import IdentificationError, present
from elastocal.identification._least_squares import RANK_TOLERANCE
from elastocal.identification.contact import Contact, TipPlace
from elastocal.identification.knowledge import DriveCompliances, weigh_contact, with_knowledge
from elastocal.identification.options import FitOptions
from elastocal.identification.problem import Problem, build
from elastocal.identification.rungs import rung_of
from elastocal.identification.solve import solve
from elastocal.robot import Robot, fixed_joint_of, with_joint_origins

_SPRINGS = "links"
"""Springs beside which the place is found: all that an arm may have."""
_STEP = 2e-3
"""Half the difference of two places by which a derivative is taken, in m."""
_STEPS, _SETTLED = 4, 2e-4
"""Most steps, and the length of the last one, in m."""


def with_tip_found(
    robot: Robot, readings: Readings, options: FitOptions
) -> tuple[Robot, FitOptions]:
    """Return the robot with its tcp where the tip is, and options whose contact says so.

    Parameters
    ----------
    robot : Robot
        With its tcp where the tip was meant to be.
    readings : Readings
        Measurements, joints in the robot's order.
    options : FitOptions
        Both stay as they are where the contact states no width for the tip's place.

    Raises
    ------
    IdentificationError
        If no fixed joint holds the tcp, or a tracker measured any reading.
    """
    contact = options.contact
    if contact is None or contact.tip is None:
        return robot, options
    if not readings.by_contact.all():
        raise IdentificationError(
            "contact.tip is for campaigns that no tracker measured: where one did, the place of the"
            " marker depends on that of the tip; leave contact.tip out"
        )
    place = np.zeros(3)
    for _ in range(_STEPS):
        found = _step(robot, readings, options, place)
        last, place = place, np.array(found.place)
        if np.linalg.norm(place - last) < _SETTLED:
            break
    return _moved(robot, place), replace(options, contact=replace(contact, tip_found=found))


def _step(robot: Robot, readings: Readings, options: FitOptions, place: FloatArray) -> TipPlace:
    """Return the place after one step from another one, with its standard errors."""
    here = _moved(robot, place)
    weighed = weigh_contact(here, readings, options)
    drives = DriveCompliances.of(here, readings, weighed)
    contact: Contact = present(weighed.contact, "contact")
    problem = _problem(here, readings, weighed, drives)
    c = solve(problem).compliance
    shifts = [
        _residuals(_problem(_moved(robot, place + shift), readings, weighed, drives), c)
        for step in _STEP * np.eye(3)
        for shift in (step, -step)
    ]
    J = np.array([(shifts[k] - shifts[k + 1]) / (2.0 * _STEP) for k in (0, 2, 4)]).T
    columns = np.concatenate(
        [problem.weighted().reshape(-1, problem.columns + 1)[:, :-1], problem.prior_rows[:, :-1]]
    )[:, c > problem.lower]
    outside = _outside(np.column_stack([J, _residuals(problem, c)]), columns)
    own, left = outside[:, :3], outside[:, 3]
    gain = contact.row_noise / present(contact.tip, "tip")
    normal = own.T @ own + gain**2 * np.eye(3)
    found = place - np.linalg.solve(normal, own.T @ left + gain**2 * place)
    sigma = contact.row_noise * np.sqrt(np.diag(np.linalg.inv(normal)))
    seen = np.linalg.norm(own, axis=0) / np.linalg.norm(J, axis=0)
    return TipPlace(triple(found), triple(sigma), triple(seen))


def _moved(robot: Robot, place: FloatArray) -> Robot:
    """Return a robot whose tcp is elsewhere by a vector in its own frame, in m."""
    joint = fixed_joint_of(robot.urdf, robot.tip)
    if joint is None:
        raise IdentificationError(
            f"contact.tip: no fixed joint holds the tcp {robot.tip!r}, so that its place cannot be"
            " found; give the tip a frame of its own (--tool-frame)"
        )
    T = np.eye(4)
    T[:3, 3] = place
    made = Robot.from_urdf(with_joint_origins(robot.urdf, {joint: T}), robot.tip, robot.base)
    return replace(made, gravity=robot.gravity)


def _problem(
    robot: Robot, readings: Readings, options: FitOptions, drives: DriveCompliances
) -> Problem:
    model = ElasticModel(robot, rung_of(robot, _SPRINGS).springs(robot, readings))
    known = with_knowledge(options, drives.known_springs(model), model, readings)
    return build(model, readings, known)


def _residuals(problem: Problem, c: FloatArray) -> FloatArray:
    """Return the weighted residuals of compliances, those of the prior last."""
    rows = problem.weighted().reshape(-1, problem.columns + 1)
    rows = np.concatenate([rows, problem.prior_rows])
    return np.asarray(rows[:, :-1] @ c - rows[:, -1])


def _outside(vectors: FloatArray, columns: FloatArray) -> FloatArray:
    """Return the parts of vectors outside the span of columns."""
    norms = np.linalg.norm(columns, axis=0)
    U, s, _ = np.linalg.svd(columns[:, norms > 0.0] / norms[norms > 0.0], full_matrices=False)
    Q = U[:, s > RANK_TOLERANCE * s[0]]
    return np.asarray(vectors - Q @ (Q.T @ vectors))
