"""Where the tip of a campaign without a tracker is, found beside the springs.

A tip that is clamped by hand is some millimetres from where the description has it. Every lever of
the arm ends there, so that the deflection ``O(q, f; r) c`` depends on its place ``r`` as well as on
the compliances. Both are fitted together (Gauss-Newton), a shift ``s`` as three further columns:

    O(q, f; r + s) c = O(q, f; r) c + (d/dr O(q, f; r) c) s

with a normal prior of the stated width about the place that the description has. The columns stay
in the last fit, so that left-out poses, draws and intervals move the tip with the springs. It is
first found beside gears that stiffen: springs without them make up by the tip for what they lack.
See docs/decisions/0137-place-of-the-tip.md and 0146-draws-move-the-tip.md.
"""

import contextlib
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from elastocal.arrays import FloatArray, triple
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.errors import IdentificationError, present
from elastocal.identification.contact import Contact, TipPlace, TipShift
from elastocal.identification.displacement import displacement_blocks, slopes_by_shift
from elastocal.identification.knowledge import DriveCompliances, weigh_contact, with_knowledge
from elastocal.identification.options import FitOptions
from elastocal.identification.problem import Problem, build
from elastocal.identification.rungs import bearing_gears, gears
from elastocal.identification.solve import solve
from elastocal.identification.uncertainty import CONFIDENCE, interval
from elastocal.robot import Robot, fixed_joint_of, with_joint_origins

_NORMAL = float(ndtri(0.5 * (1.0 + CONFIDENCE)))
_STEPS, _SETTLED = 6, 1e-4
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
    nowhere = TipPlace((0.0, 0.0, 0.0), contact.tip, (0.0, 0.0, 0.0))
    options = replace(options, contact=replace(contact, tip_found=nowhere))
    for _ in range(_STEPS):
        weighed = weigh_contact(robot, readings, options)
        drives = DriveCompliances.of(robot, readings, weighed)
        problem, model = _beside_gears(robot, readings, weighed, drives)
        shift = solve(problem).compliance[problem.tip_columns]
        robot, options = _shifted(model.robot, options, shift, beside_gears=True)
        if np.linalg.norm(shift) < _SETTLED:
            break
    return robot, options


def _beside_gears(
    robot: Robot, readings: Readings, options: FitOptions, drives: DriveCompliances
) -> tuple[Problem, ElasticModel]:
    """Return the problem of the tip beside gears; on bearings, where links imitate the contact."""
    for springs in (gears, bearing_gears):
        model = ElasticModel(robot, springs(robot, readings))
        with contextlib.suppress(IdentificationError):
            known = with_knowledge(options, drives.known_springs(model), model, readings)
            return with_tip_open(build(model, readings, known), model, readings, known), model
    raise IdentificationError(
        "contact.tip needs a normal compliance that gears do not imitate: state contact.normal"
    )


def settle_tip(
    model: ElasticModel,
    readings: Readings,
    options: FitOptions,
    marker_offset: ArrayLike | None = None,
) -> tuple[ElasticModel, FitOptions, Problem]:
    """Return a model with its tcp where its own springs have the tip, and the problem of both.

    Parameters
    ----------
    model, readings, options, marker_offset
        As for `elastocal.identification.build`, with the tip found (`with_tip_found`); without one
        the model stays as it is.
    """
    problem = build(model, readings, options, marker_offset)
    if options.contact is None or options.contact.tip_found is None:
        return model, options, problem
    for _ in range(_STEPS):
        problem = with_tip_open(problem, model, readings, options)
        shift = solve(problem, options.loss).compliance[problem.tip_columns]
        if np.linalg.norm(shift) < _SETTLED:
            break
        robot, options = _shifted(model.robot, options, shift, beside_gears=False)
        model = ElasticModel(robot, model.springs)
        problem = build(model, readings, options, marker_offset)
    else:
        problem = with_tip_open(problem, model, readings, options)
    return model, options, problem


def with_tip_open(
    problem: Problem, model: ElasticModel, readings: Readings, options: FitOptions
) -> Problem:
    """Return a problem with columns of a shift of the tip, about the springs that it has alone."""
    contact = present(options.contact, "contact")
    found = present(contact.tip_found, "tip_found")
    c = solve(problem, options.loss).compliance[problem.springs]

    def displacement(by: FloatArray) -> FloatArray:
        moved = ElasticModel(_moved(model.robot, by), model.springs)
        return np.asarray(displacement_blocks(moved, readings) @ c)

    columns = slopes_by_shift(displacement)
    known = TipShift(-np.array(found.place), found.stated, contact.row_noise)
    return problem.with_tip(columns, model.parameters[0].scale, known)


def tip_with_interval(contact: Contact, draws: FloatArray) -> Contact:
    """Return a contact whose tip has the 95 % interval of draws of its shift.

    How far the tip lies from where other springs have it counts as a standard deviation of its own:
    no draw of one model shows what its springs lack.

    Parameters
    ----------
    contact : Contact
        With the tip found.
    draws : ndarray, shape (draw, 3)
        From the place that was found, in m.
    """
    found = present(contact.tip_found, "tip_found")
    place = np.array(found.place)
    apart = _NORMAL * (place - np.array(found.beside_gears))
    below, above = (np.hypot(end, apart) for end in interval(draws))
    ends = triple(place - below), triple(place + above)
    return replace(contact, tip_found=replace(found, low=ends[0], high=ends[1]))


def as_described(robot: Robot, options: FitOptions) -> Robot:
    """Return the robot with its tcp where the description has it, and not where the tip is."""
    if options.contact is None or options.contact.tip_found is None:
        return robot
    return _moved(robot, -np.array(options.contact.tip_found.place))


def _shifted(
    robot: Robot, options: FitOptions, shift: FloatArray, beside_gears: bool
) -> tuple[Robot, FitOptions]:
    """Return a robot with its tcp moved by a shift, and options whose contact says where it is."""
    contact = present(options.contact, "contact")
    found = present(contact.tip_found, "tip_found")
    place = triple(np.array(found.place) + shift)
    found = replace(found, place=place, beside_gears=place if beside_gears else found.beside_gears)
    return _moved(robot, shift), replace(options, contact=replace(contact, tip_found=found))


def _moved(robot: Robot, shift: FloatArray) -> Robot:
    """Return a robot whose tcp is elsewhere by a vector in its own frame, in m."""
    joint = fixed_joint_of(robot.urdf, robot.tip)
    if joint is None:
        raise IdentificationError(
            f"contact.tip: no fixed joint holds the tcp {robot.tip!r}, so that its place cannot be"
            " found; give the tip a frame of its own (--tool-frame)"
        )
    T = np.eye(4)
    T[:3, 3] = shift
    made = Robot.from_urdf(with_joint_origins(robot.urdf, {joint: T}), robot.tip, robot.base)
    return replace(made, gravity=robot.gravity)
