"""Compare two calibrations of one cell (recertification)."""

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.elastic import check_vectors
from elastocal.errors import IdentificationError, SpringError
from elastocal.identification.calibrated import CalibratedModel
from elastocal.identification.recertification.caveats import caveats
from elastocal.identification.recertification.comparable import common_springs
from elastocal.identification.recertification.judgement import judge
from elastocal.identification.recertification.result import Recertification
from elastocal.identification.recertification.rows import compare_rows
from elastocal.identification.recertification.same_robot import (
    check_same_robot,
    outside_limits,
)
from elastocal.identification.recertification.spread import Spread
from elastocal.identification.recertification.springs import compare_springs


def recertify(
    old: CalibratedModel,
    new: CalibratedModel,
    q: ArrayLike | None = None,
    force: ArrayLike | None = None,
    moment: ArrayLike | None = None,
    *,
    limit: float | None = None,
    names: tuple[str, str] = ("the old model", "the new model"),
) -> Recertification:
    """Compare two calibrations of one cell.

    Parameters
    ----------
    old, new : CalibratedModel
        The calibrations, of the same robot and tcp.
    q : array_like, shape (row, joint), optional
        Joint positions at which predictions are compared, in rad or m. Without rows only
        springs are compared.
    force : array_like, shape (row, 3), optional
        Force on the robot at the tcp in base, in N; needed with ``q``.
    moment : array_like, shape (row, 3), optional
        Moment on the robot about the tcp in base, in N·m.
    limit : float, optional
        Largest change of predicted deflection that is accepted at these rows, in m.
    names : tuple of str
        What to call the models in a refusal.

    Raises
    ------
    IdentificationError
        If the models are of different robots or tool centre points, are one and the same, or the
        limit is not a positive number.
    SpringError, RobotError
        If rows have another shape or are not finite.
    """
    if limit is not None and not 0.0 < limit < np.inf:
        raise IdentificationError(f"limit {limit:g} m: a largest accepted change is above 0")
    check_same_robot(old.model.robot, new.model.robot, names)
    if _is_one(old, new):
        raise IdentificationError(
            f"{names[0]} and {names[1]} are one and the same calibration: nothing to compare"
        )
    spread = Spread.of(old, new)
    loads = None if q is None else _checked(new, q, force, moment)
    deflection = None if loads is None else compare_rows(old, new, spread, *loads)
    verdict, reason = judge(deflection, limit)
    springs = compare_springs(old, new, spread)
    common = [spring.name for spring in common_springs(old, new)]
    told = {term.spring for change in springs for term in change.terms}
    only_old, only_new = (
        tuple(name for name in each.model.spring_names if name not in common) for each in (old, new)
    )
    outside = 0 if loads is None else outside_limits(new.model.robot, loads[0])
    return Recertification(
        robot=new.model.robot.name,
        tcp=new.model.robot.tip,
        old_provenance=old.provenance,
        new_provenance=new.provenance,
        springs=springs,
        not_compared=tuple(name for name in common if name not in told),
        only_old=only_old,
        only_new=only_new,
        deflection=deflection,
        limit=limit,
        verdict=verdict,
        reason=reason,
        notes=caveats(old, new, not only_old and not only_new, outside),
    )


def _is_one(old: CalibratedModel, new: CalibratedModel) -> bool:
    return np.array_equal(old.compliance, new.compliance) and np.array_equal(old.draws, new.draws)


def _checked(
    model: CalibratedModel, q: ArrayLike, force: ArrayLike | None, moment: ArrayLike | None
) -> tuple[FloatArray, FloatArray, FloatArray | None]:
    """Return rows as arrays, or refuse them by shape or value."""
    joints = model.model.robot.check_positions(q)
    if force is None:
        raise SpringError("rows have joint positions q but no force")
    loads = {"force": force} | ({} if moment is None else {"moment": moment})
    vectors = {name: check_vectors(name, each) for name, each in loads.items()}
    for name, array in vectors.items():
        if joints.ndim != 2 or not len(joints) or array.shape != (len(joints), 3):
            raise SpringError(
                f"{name} {array.shape} does not have a row for each of q {joints.shape}"
            )
    return joints, vectors["force"], vectors.get("moment")
