"""Springs, and sums of springs, that two calibrations both determine.

A calibration does not determine all springs: adding any multiple of one of its unobservable
combinations ``v`` changes no deflection that was measured. A weighted sum ``w . c`` is determined
when ``w . v = 0`` for every such ``v``. So the comparison covers the springs that occur in no ``v``
of either model, and a sparse basis of the sums that both models determine.

The knees of gears are scaled to the loads of their campaign: parameters of two campaigns cannot be
compared one by one. The comparison uses the mean compliance between the smallest and the largest
total torque, ``a`` and ``b``, that the gear met in both,

    (theta(b) - theta(a)) / (b - a),

and its lost motion. Both are linear in the parameters of their model.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.elastic import OneAxisSpring, Parameter, Spring, SpringLoad
from elastocal.errors import IdentificationError
from elastocal.identification.calibrated import CalibratedModel
from elastocal.identification.spring_sums import (
    Term,
    complement,
    sparse_basis,
    sum_weights,
)


@dataclass(frozen=True, eq=False)
class SharedNumber:
    """A number that both models have: a parameter, or what a gear amounts to."""

    name: str
    """Name of the parameter, or of the gear."""
    spring: str
    """Name of its spring."""
    joint: str
    unit: str
    old: FloatArray
    """Weights that make it of the old model's parameters, shape (parameter,)."""
    new: FloatArray
    """The same of the new model's."""


def common_springs(old: CalibratedModel, new: CalibratedModel) -> tuple[Spring, ...]:
    """Return the springs that both models have, same axis and place, in the new one's order.

    Gears that differ in their knees alone are the same spring.
    """
    known = {_identity(spring) for spring in old.model.springs}
    return tuple(spring for spring in new.model.springs if _identity(spring) in known)


def shared_numbers(old: CalibratedModel, new: CalibratedModel) -> tuple[SharedNumber, ...]:
    """Return the numbers of the springs that both models have, in the new one's order."""
    before = {_identity(spring): spring for spring in old.model.springs}
    met = [_torques_met(each) for each in (old, new)]
    names = [each.model.parameter_names for each in (old, new)]
    found = []
    for spring in common_springs(old, new):
        pair = before[_identity(spring)], spring
        if _stiffens(spring):
            ranges = [own[spring.name] for own in met]
            low, high = max(r[0] for r in ranges), min(r[1] for r in ranges)
            numbers = _numbers_of_gears(pair, low, high)
        else:
            unit_vectors = np.eye(len(spring.parameters))
            numbers = [
                (parameter.name, parameter.unit.si, (row, row))
                for parameter, row in zip(spring.parameters, unit_vectors, strict=True)
            ]
        for name, unit, rows in numbers:
            whole = [
                _placed(row, each.parameters, own)
                for row, each, own in zip(rows, pair, names, strict=True)
            ]
            found.append(SharedNumber(name, spring.name, spring.joint, unit, *whole))
    return tuple(found)


def _stiffens(spring: Spring) -> bool:
    return isinstance(spring, OneAxisSpring) and spring.bears_weight


def _identity(spring: Spring) -> object:
    """Return the key by which two springs are the same one."""
    if not _stiffens(spring):
        return spring
    return (type(spring), *(getattr(spring, name) for name in sorted(spring.places)))


def _numbers_of_gears(
    pair: tuple[Spring, Spring], low: float, high: float
) -> list[tuple[str, str, tuple[FloatArray, FloatArray]]]:
    """Return name, unit and weights over the own parameters of what two gears amount to."""
    numbers = []
    name, unit = pair[1].name, pair[1].parameters[0].unit
    if high > low:
        way = SpringLoad((np.array(high - low),), (np.array(low),))
        mean = [np.array(spring.angles(way)[0], dtype=float) / (high - low) for spring in pair]
        numbers.append((name, unit.si, (mean[0], mean[1])))
    others = [
        {each.name: each for each in spring.characteristics if each.unit != unit} for spring in pair
    ]
    for name in (name for name in others[1] if name in others[0]):
        rows = [np.array(own[name].weights) for own in others]
        numbers.append((name, others[1][name].unit.si, (rows[0], rows[1])))
    return numbers


def _torques_met(calibrated: CalibratedModel) -> dict[str, tuple[float, float]]:
    """Return the range of the total torque about the first axis of each spring, in N·m.

    Empty, from infinity down, where the model does not know where it was calibrated.
    """
    model, domain = calibrated.model, calibrated.domain
    nothing = np.full(sum(len(spring.axes) for spring in model.springs), np.inf)
    low, high = nothing, -nothing
    if domain is not None:
        at = model.at(domain.joint_position[domain.reading_pose])
        total = at.weight + model.load_torques(at, domain.force, domain.moment)
        low = np.minimum(at.weight, total).min(axis=0)
        high = np.maximum(at.weight, total).max(axis=0)
    first = np.cumsum([0, *(len(spring.axes) for spring in model.springs)])
    return {
        spring.name: (float(low[axis]), float(high[axis]))
        for spring, axis in zip(model.springs, first, strict=False)
    }


def _placed(
    weights: FloatArray, parameters: Sequence[Parameter], names: Sequence[str]
) -> FloatArray:
    """Return weights over all parameters of a model, from those over a spring's."""
    whole = np.zeros(len(names))
    whole[[names.index(parameter.name) for parameter in parameters]] = weights
    return whole


def comparable_sums(
    old: CalibratedModel,
    new: CalibratedModel,
    numbers: Sequence[SharedNumber] | None = None,
) -> tuple[tuple[Term, ...], ...]:
    """Return the sums of numbers that both models determine.

    Parameters
    ----------
    old, new : CalibratedModel
        Two calibrations of one robot.
    numbers : sequence of SharedNumber, optional
        Those of both models.

    Returns
    -------
    tuple of tuple of Term
        Single numbers with weight 1, and sums of several; in the order of the springs. Springs of
        one model only are in none.

    Raises
    ------
    IdentificationError
        If an unobservable combination names a spring that its model does not have.
    """
    numbers = shared_numbers(old, new) if numbers is None else numbers
    if not numbers:
        return ()
    unseen = np.vstack(
        [
            _unobservable(old, numbers, np.array([each.old for each in numbers])),
            _unobservable(new, numbers, np.array([each.new for each in numbers])),
        ]
    )
    mixed = np.flatnonzero(np.any(unseen != 0.0, axis=0))
    sums: dict[int, list[tuple[Term, ...]]]
    sums = {i: [(Term(number.name, 1.0),)] for i, number in enumerate(numbers)}
    for i in mixed:
        sums[int(i)] = []
    joints = list(dict.fromkeys(number.joint for number in numbers))
    determined = complement(unseen[:, mixed])
    for vector in sparse_basis(
        determined, [joints.index(numbers[i].joint) for i in mixed.tolist()]
    ):
        members = np.flatnonzero(vector)
        terms = tuple(Term(numbers[mixed[m]].name, float(vector[m])) for m in members)
        sums[int(mixed[members[0]])].append(terms)
    return tuple(each for i in sorted(sums) for each in sums[i])


def _unobservable(
    calibrated: CalibratedModel, numbers: Sequence[SharedNumber], rows: FloatArray
) -> FloatArray:
    """Return by how much each unobservable combination of a model changes the numbers.

    Shape (combination, number), from the numbers' weights over its parameters.
    """
    seen, own = calibrated.observability, calibrated.model.parameter_names
    for term in (term for group in (*seen.unobservable, *seen.hidden) for term in group):
        if term.spring not in own:
            raise IdentificationError(
                f"unobservable combination names spring {term.spring!r}, which the model does not"
                f" have (springs: {', '.join(own)})"
            )
    groups = [*seen.unobservable, *seen.hidden]
    # What is too weak to see has no value to compare. A gear has: its other parameters.
    parameters = {number.name for number in numbers}
    groups += [(Term(each.name, 1.0),) for each in seen.faint if each.name in parameters]
    return sum_weights(groups, own) @ rows.T
