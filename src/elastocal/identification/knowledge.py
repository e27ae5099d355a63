"""Prior knowledge of springs from a file, and of all others from the drives.

A spring file states stiffnesses and bounds. The arm itself gives a prior: a bearing, a housing or a
link that is softer than the adjacent drive would be a defect. Where poses and loads hardly turn a
spring, a fit with bounds alone gives it a compliance that depends on the noise, and where
production turns it the predicted deflection would be wrong by millimetres. So a compliance is
expected to be at most of the size of the compliance of its joint's drive: a normal prior about zero
of that width, for all springs alike. It hardly changes what the data determine. See
docs/decisions/0066-ladder.md. What the prior alone made is not called known
(docs/decisions/0124-known-by-readings.md).
"""

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, KnownSpring, Parameter, Spring, actuated, bearing
from elastocal.errors import IdentificationError, present
from elastocal.identification.contact import (
    LATERAL,
    NORMAL,
    Contact,
    guessed,
    is_doubled,
    require_pressed,
    with_doubled,
)
from elastocal.identification.observability import find_hidden, likely_sizes, observability
from elastocal.identification.options import MEDIAN_NORM, FitOptions, Prior, bounds
from elastocal.identification.problem import Problem, build
from elastocal.identification.rungs import bearing_gears, gears
from elastocal.identification.solve import factor, solve
from elastocal.identification.uncertainty import leave_poses_out
from elastocal.results import brief_repr
from elastocal.robot import Robot

_ROUNDS = 3
"""Fits after which the noise of a row no longer changes."""
_LEAST_NOISE = 1e-7
"""Least noise of a row in m, of simulated readings without any."""
_SURE = 2.0
"""Standard errors above zero from which the compliance of a drive is known."""

_WRIST = 5.0
"""Compliance of a wrist's drive over what all springs of an arm have together, which its long
levers at the base decide; 2.5 to 8 on the four arms of `tests/independent`."""


@brief_repr
@dataclass(frozen=True, eq=False)
class DriveCompliances:
    """Compliance of the drive of each joint, which no other spring of an arm exceeds by far."""

    joints: tuple[str, ...]
    softness: FloatArray
    """Compliance of the drive over the usual one for its kind; that of the softest where the
    readings do not determine it or the joint slides, at least that of a wrist, shape (joint,)."""

    @classmethod
    def of(
        cls,
        robot: Robot,
        readings: Readings,
        options: FitOptions,
        marker_offset: ArrayLike | None = None,
    ) -> "DriveCompliances":
        """Return those estimated by a spring at each joint alone.

        Parameters
        ----------
        robot, readings, options, marker_offset
            As for `elastocal.identification.choose_model`.
        """
        model = ElasticModel(robot, actuated(robot))
        problem = build(model, readings, replace(options, prior=None), marker_offset)
        return cls.of_problem(robot.joint_names, robot.revolute, problem, model.springs)

    @classmethod
    def of_problem(
        cls,
        joints: Sequence[str],
        revolute: Sequence[bool],
        problem: Problem,
        springs: Sequence[Spring],
    ) -> "DriveCompliances":
        """Return those estimated by a problem with one axial spring at each joint.

        Parameters
        ----------
        joints, revolute : sequence of str and of bool
            Names of the joints, and whether they turn.
        problem : Problem
            Without a prior.
        springs : sequence of Spring
            One a joint, in their order.
        """
        c = solve(problem).compliance[problem.springs]
        left = leave_poses_out(problem).compliance[:, problem.springs]
        folds = len(left)
        error = np.sqrt((folds - 1) / folds * np.sum(np.square(left - c), axis=0))
        parameters = [parameter for spring in springs for parameter in spring.parameters]
        scale = np.array([parameter.scale for parameter in parameters])
        plain = problem.of_springs()
        usual = likely_sizes(plain, parameters)
        seen = observability(factor(plain), springs, plain, c)
        seen = find_hidden(seen, plain, c, parameters, usual)
        known = (c > _SURE * error) & np.array(seen.observable)
        own = known & np.array(revolute)
        softest = max([_WRIST * float(usual[0] / scale[0]), *(c / scale)[known].tolist()])
        return cls(tuple(joints), np.where(own, c / scale, softest))

    def sizes(self, parameters: Sequence[Parameter]) -> FloatArray:
        """Return the largest likely size of parameters, shape (parameter,), in their units."""
        softness = dict(zip(self.joints, self.softness.tolist(), strict=True))
        return np.array([softness[each.joint] * each.scale for each in parameters])

    def known_springs(self, model: ElasticModel) -> tuple[KnownSpring, ...]:
        """Return the prior knowledge of every parameter of a model of the arm."""
        sizes = self.sizes(model.parameters).tolist()
        return tuple(
            KnownSpring(each.name, compliance=0.0, sigma=size)
            for each, size in zip(model.parameters, sizes, strict=True)
        )


def with_knowledge(
    options: FitOptions,
    known: Sequence[KnownSpring],
    model: ElasticModel,
    readings: Readings,
    marker_offset: ArrayLike | None = None,
) -> FitOptions:
    """Return options of a fit that uses what is known of springs.

    A prior is weighed against the noise of one component of a deflection: the robust residual of a
    fit without it.

    Parameters
    ----------
    options : FitOptions
        What else was chosen.
    known : sequence of KnownSpring
        What is known; the options as they are without any.
    model : ElasticModel
        Robot and springs.
    readings : Readings
        Measurements, joints in the robot's order.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m.

    Raises
    ------
    IdentificationError
        If a spring is not the model's, or bounds contradict those of the options.
    """
    if not known:
        return options
    names = list(model.parameter_names)
    natural = [parameter.lower for parameter in model.parameters]
    lower, upper = (np.array(each) for each in bounds(options, len(names), natural))
    rows, mean, sigma = (
        np.zeros((len(known), len(names))),
        np.zeros(len(known)),
        np.ones(len(known)),
    )
    sigma *= np.inf
    for number, each in enumerate(known):
        columns = _columns_of(each, model)
        rows[number, columns] = 1.0 if each.weights is None else each.weights
        if each.weights is None:
            lower[columns] = np.maximum(lower[columns], -np.inf if each.low is None else each.low)
            upper[columns] = np.minimum(upper[columns], np.inf if each.high is None else each.high)
        if each.compliance is not None and each.sigma is not None:
            mean[number], sigma[number] = each.compliance, each.sigma
    bounded = replace(options, lower=lower, upper=upper, prior=None)
    if not np.isfinite(sigma).any():
        return bounded
    problem = build(model, readings, bounded, marker_offset)
    # Readings without any noise reduce the weight of a prior, but not to zero.
    smallest = np.finfo(float).eps * float(np.abs(problem.d).max())
    _, noise = robust_fit(problem, smallest)
    return replace(bounded, prior=Prior(mean, sigma, noise, rows))


def robust_fit(problem: Problem, least: float = _LEAST_NOISE) -> tuple[FloatArray, float]:
    """Return the compliances of a robust fit, and the noise of one component of a row.

    Parameters
    ----------
    problem : Problem
        What is fitted.
    least : float
        Least noise, of readings without any, in m.

    Returns
    -------
    compliance : ndarray, shape (column,)
    noise : float
        Robust standard deviation of the residuals, in m.
    """
    found = solve(problem, "huber")
    residual = problem.residuals(found.compliance)
    own = np.linalg.norm(problem.own_errors(residual, factor=found.reading_weight), axis=1)
    return found.compliance, max(float(np.median(own)) / MEDIAN_NORM, least)


def expected_sizes(
    prior: Prior | None, problem: Problem, parameters: Sequence[Parameter]
) -> tuple[FloatArray, bool]:
    """Return the size that was expected of each parameter, and whether the fit has it as prior.

    That of the prior of the drives; without one, that of all springs of the arm together. What a
    spring file states is no expectation for a class of arms.

    Parameters
    ----------
    prior : Prior or None
        That of the fit.
    problem : Problem
        Problem of the springs, without frames.
    parameters : sequence of Parameter
        In column order.

    Returns
    -------
    sizes : ndarray, shape (parameter,)
        In the units of the parameters.
    held : bool
        Whether a prior of these sizes is part of the fit.
    """
    sizes = likely_sizes(problem, parameters)
    if prior is None or prior.rows is None or np.any(prior.mean):
        return sizes, False
    if not np.array_equal(prior.rows, np.eye(len(sizes))):
        return sizes, False
    sigma = np.asarray(prior.sigma, dtype=float)
    return (sigma, True) if np.isfinite(sigma).all() else (sizes, False)


def weigh_contact(
    robot: Robot,
    readings: Readings,
    options: FitOptions,
    marker_offset: ArrayLike | None = None,
) -> FitOptions:
    """Return options whose contact is weighed against the noise of the readings.

    First fits state the robust residual of a row, against which the prior and the errors that
    readings share are weighed, and compliances of which the spread is a share. They are fits by
    gears, or by springs at bearings, with gears if these do not, where they imitate a compliance
    that is free.

    Parameters
    ----------
    robot, readings, options, marker_offset
        As for `elastocal.identification.choose_model`; options without a contact stay as they are.

    Raises
    ------
    IdentificationError
        If no reading is by contact, one is pulled, or bearing springs too imitate a compliance of
        the contact that is free.
    """
    if options.contact is None:
        return options
    require_pressed(robot, readings)
    plain = replace(options, prior=None)
    if is_doubled(readings):
        # The arm's part in the differences needs a fit, of any springs that fit at all.
        first = ElasticModel(robot, bearing(robot))
        guess = replace(plain, contact=guessed(options.contact))
        problem = build(first, readings, guess, marker_offset)
        arm = _of_arm(problem, solve(problem, "huber").compliance)
        plain = replace(plain, contact=with_doubled(options.contact, robot, readings, arm))
    for springs in (gears, bearing_gears):
        model = ElasticModel(robot, springs(robot, readings))
        with contextlib.suppress(IdentificationError):
            return replace(options, contact=_weighed(model, readings, plain, marker_offset))
    model = ElasticModel(robot, bearing(robot))
    return replace(options, contact=_weighed(model, readings, plain, marker_offset))


def _weighed(
    model: ElasticModel,
    readings: Readings,
    options: FitOptions,
    marker_offset: ArrayLike | None,
) -> Contact:
    """Return a contact with the noise of a row and the compliances of fits by a model."""
    contact = present(options.contact, "contact")
    for _ in range(_ROUNDS):
        problem = build(model, readings, replace(options, contact=contact), marker_offset)
        found, noise = robust_fit(problem)
        contact = weighed_contact(contact, problem, found, noise)
        contact = with_doubled(contact, model.robot, readings, _of_arm(problem, found))
    return contact


def weighed_contact(
    contact: Contact, problem: Problem, compliance: FloatArray, noise: float
) -> Contact:
    """Return a contact with the noise of a row and the compliances of a first fit."""
    found = compliance[problem.contact_columns].tolist()
    size = dict(zip(problem.contact, found, strict=True))
    return replace(contact, noise=noise, size=(size.get(NORMAL, 0.0), size.get(LATERAL, 0.0)))


def _of_arm(problem: Problem, compliance: FloatArray) -> FloatArray:
    """Return what the springs predict of each reading, shape (reading, 3), in m."""
    return np.asarray(problem.O[:, :, problem.springs] @ compliance[problem.springs])


def _columns_of(known: KnownSpring, model: ElasticModel) -> list[int]:
    """Return the parameters that something is known of: all of a gear, or the one of that name."""
    names = list(model.parameter_names)
    if known.weights is None and known.name in names:
        return [names.index(known.name)]
    springs = {spring.name: spring for spring in model.springs}
    if known.weights is None or known.name not in springs:
        raise IdentificationError(f"the model has no spring {known.name!r} to know anything of")
    return [names.index(parameter.name) for parameter in springs[known.name].parameters]
