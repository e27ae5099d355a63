"""How far the laws of gears are off where production loads them beyond what calibration did.

A gear stiffens with the *total* torque, of the arm's weight and of the load. What its compliance is
at torques that no reading met, its law extrapolates, and every draw of the fit does so alike: they
say nothing of how wrong that is. A pull at a posture where presses had worked against the weight is
the common case, and a longer tool another.

Makers of strain-wave gears state stiffnesses by zones of torque, the least of them some 0.55 of the
largest. So beyond the calibrated torques a compliance may be anything between that at their end and
0.55 of it, or as much above: a fifth to either side of the middle, whatever the law says.
"""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.elastic import ElasticModel, ModelPosture
from elastocal.identification.domain import CalibrationDomain
from elastocal.results import brief_repr

_UNKNOWN_PART = 0.5 * (1.0 - 0.55)
"""Half of the range of compliances that catalogues state, over the largest: the 95 % interval of a
compliance beyond all calibrated torques, over that at their end."""


@brief_repr
@dataclass(frozen=True, eq=False)
class CalibratedTorques:
    """Total torques, weight and load together, that the readings of a calibration met."""

    low: FloatArray
    """Smallest about each axis of the springs, shape (axis,), in N·m or N."""
    high: FloatArray
    """Largest."""

    @classmethod
    def of(cls, model: ElasticModel, domain: CalibrationDomain) -> "CalibratedTorques":
        """Return those of a calibration.

        Parameters
        ----------
        model : ElasticModel
            With the tool that it was calibrated with.
        domain : CalibrationDomain
            Its poses and loads.
        """
        q, pose = domain.joint_position, domain.reading_pose
        weight = model.weight_torques(q)
        loaded = weight[pose] + model.load_torques(q[pose], domain.force, domain.moment)
        total = np.concatenate([weight, loaded])
        return cls(total.min(axis=0), total.max(axis=0))

    def error(
        self,
        model: ElasticModel,
        compliance: FloatArray,
        posture: ModelPosture,
        torque: FloatArray,
    ) -> FloatArray:
        """Return by how much gears beyond these torques may move the tcp, in m.

        Gears err independently of one another, each by a part of what it turns beyond the end.
        Half of the 95 % interval along each axis, shape (row, 3); zero within these torques.

        Parameters
        ----------
        model : ElasticModel
            Springs, with any tool.
        compliance : ndarray, shape (parameter,)
            In the units of the parameters.
        posture : ModelPosture
            Joint positions of the rows.
        torque : ndarray, shape (row, axis)
            Of the load about each axis, in N·m or N.
        """
        weight = posture.weight
        least, most = np.minimum(weight, weight + torque), np.maximum(weight, weight + torque)
        beyond = np.maximum(most - np.maximum(least, self.high), 0.0)
        beyond += np.maximum(np.minimum(most, self.low) - least, 0.0)
        end = np.clip(weight + torque, self.low, self.high)
        turned = _UNKNOWN_PART * model.compliance_at_torque(compliance, end) * beyond
        squares = np.square(posture.jacobian.translation) @ np.square(turned)[..., None]
        return np.asarray(np.sqrt(squares[..., 0]))
