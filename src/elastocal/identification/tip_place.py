"""Where the tip of a campaign without a tracker is, found beside the springs.

A tip that is clamped by hand is some millimetres from where the description has it. Every lever of
the arm ends there, so that the deflection ``O(q, f; r) c`` depends on its place ``r`` as well as on
the compliances. Both are fitted together (Gauss-Newton), a shift ``s`` as three further columns:

    O(q, f; r + s) c = O(q, f; r) c + (d/dr O(q, f; r) c) s

with a normal prior of the stated width about the place that the description has. The columns stay
in the last fit, so that left-out poses, draws and intervals move the tip with the springs. It is
first found beside gears that stiffen: springs without them make up by the tip for what they lack.
See docs/decisions/0137-place-of-the-tip.md and docs/decisions/0146-draws-move-the-tip.md.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray, triple
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.errors import IdentificationError, present
from elastocal.identification.contact import Contact, TipPlace
from elastocal.identification.displacement import displacement_blocks, slopes_by_shift
from elastocal.identification.knowledge import DriveCompliances, weigh_contact, with_knowledge
from elastocal.identification.ladder import usable_for_choice
from elastocal.identification.options import FitOptions
from elastocal.identification.problem import OpenNumbers, Problem, build
from elastocal.identification.rungs import bearing_gears, gears
from elastocal.identification.solve import solve
from elastocal.identification.suspicious import screen
from elastocal.identification.uncertainty import NORMAL_QUANTILE, interval
from elastocal.robot import Robot, fixed_joint_of, with_joint_origins

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
        If no fixed joint holds the tcp, a tracker measured any reading, or readings have moments.
    """
    contact = options.contact
    if contact is None or contact.tip is None:
        return robot, options
    if not readings.by_contact.all():
        raise IdentificationError(
            "contact.tip is for campaigns that no tracker measured: where one did, the place of the"
            " marker depends on that of the tip; leave contact.tip out"
        )
    if readings.moment is not None:
        raise IdentificationError(
            "contact.tip is for readings of forces alone: moments are about the tcp that is stated,"
            " and about the tip they are others; leave the columns of the moment out, or"
            " contact.tip"
        )
    nowhere = TipPlace((0.0, 0.0, 0.0), contact.tip, (0.0, 0.0, 0.0))
    options = replace(options, contact=replace(contact, tip_found=nowhere))
    # A single blunder would move the tip by centimetres.
    readings = usable_for_choice(robot, readings, options)
    for _ in range(_STEPS):
        weighed = weigh_contact(robot, readings, options)
        drives = DriveCompliances.of(robot, readings, weighed)
        problem, model = _beside_gears(robot, readings, weighed, drives)
        shift = _shift_of(problem, options)
        robot, options = _shifted(model.robot, options, shift, beside_gears=True)
        if np.linalg.norm(shift) < _SETTLED:
            break
    return robot, options


def _beside_gears(
    robot: Robot, readings: Readings, options: FitOptions, drives: DriveCompliances
) -> tuple[Problem, ElasticModel]:
    """Return the problem of the tip beside gears; on bearings, where links imitate the contact."""
    reason = ""
    for springs in (gears, bearing_gears):
        model = ElasticModel(robot, springs(robot, readings))
        try:
            known = with_knowledge(options, drives.known_springs(model), model, readings)
            problem = build(model, readings, known)
            c = _springs_of(problem, known)
            return with_tip_open(problem, model, readings, known, c), model
        except IdentificationError as error:
            reason = str(error)
    raise IdentificationError(f"contact.tip is found beside gears: {reason}")


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
        the model stays as it is. Blunders are passed over where the options set them aside.
    """
    problem = build(model, readings, options, marker_offset)
    if options.contact is None or options.contact.tip_found is None:
        return model, options, problem
    kept = ~(screen(problem).blunder & options.set_blunders_aside)
    for left in range(_STEPS, -1, -1):
        c = _springs_of(problem.take(kept), options)
        problem = with_tip_open(problem, model, readings, options, c)
        shift = _shift_of(problem.take(kept), options)
        if not left or np.linalg.norm(shift) < _SETTLED:
            break
        robot, options = _shifted(model.robot, options, shift, beside_gears=False)
        model = ElasticModel(robot, model.springs)
        problem = build(model, readings, options, marker_offset)
    return model, options, problem


def _springs_of(problem: Problem, options: FitOptions) -> FloatArray:
    """Return the compliances that fit a problem, shape (spring,), in rad/(N·m) or m/N."""
    return np.asarray(solve(problem, options.loss).compliance[problem.springs])


def _shift_of(problem: Problem, options: FitOptions) -> FloatArray:
    """Return the shift of the tip that fits a problem, shape (3,), in m."""
    return np.asarray(solve(problem, options.loss).compliance[problem.tip_columns])


def with_tip_open(
    problem: Problem,
    model: ElasticModel,
    readings: Readings,
    options: FitOptions,
    compliance: FloatArray,
) -> Problem:
    """Return a problem with columns of a shift of the tip, about some compliances."""
    contact = present(options.contact, "contact")
    found = present(contact.tip_found, "tip_found")

    def displacement(by: FloatArray) -> FloatArray:
        moved = ElasticModel(_moved(model.robot, by), model.springs)
        return np.asarray(displacement_blocks(moved, readings) @ compliance)

    columns = slopes_by_shift(displacement)
    shift = OpenNumbers(columns, -np.array(found.place), found.stated, contact.row_noise)
    return problem.with_tip(shift, model.parameters[0].scale)


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
    apart = NORMAL_QUANTILE * (place - np.array(found.beside_gears))
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
