"""The springs by which the studio predicts: of a calibrated model, else a rule of thumb."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray, Triple, triple
from elastocal.cell import Cell
from elastocal.elastic import ElasticModel, layout
from elastocal.identification import CalibratedModel
from elastocal.identification.mistakes import DRIVE, WIND_UP
from elastocal.planning.surface import arm_reach
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.units import in_unit, quantity
from elastocal.wording import mm

_MICROMETRES = 1e-6
_NOT_CALIBRATED = {
    (False, True): "this posture was",
    (True, False): "this load was",
    (False, False): "posture and load were",
}
"""What was not, by whether posture and load were."""
_RIGID = 1e-12
"""Compliance in m/N below which a spring counts as rigid."""


@record()
class CaseFigure:
    """One load case at a posture."""

    name: str
    force: str
    """In the tcp frame."""
    size: str
    """Norm of the predicted deflection."""
    parts: tuple[str, ...]
    """Along x, y, z of base, in mm."""
    intervals: tuple[str, ...]
    """95 % of a measurement along each; empty where nothing is known of it."""
    deflection: Triple
    """In base, in m."""
    caveat: str = ""
    """Why the interval may not hold; empty where posture and load were calibrated."""


@record()
class StiffnessFigure:
    """Stiffness of the tool centre point along one direction."""

    name: str
    text: str


@brief_repr
@dataclass(frozen=True, eq=False)
class StudioSprings:
    """An elastic model with compliances, and where they come from."""

    model: ElasticModel
    compliance: FloatArray
    """Shape (parameter,)."""
    source: str
    """Origin of the springs, in words, for the reader of a prediction."""
    calibrated: CalibratedModel | None = None
    """Whether there are intervals, unlike for springs by rule of thumb."""

    def stiffness(self, q: FloatArray, T: FloatArray) -> tuple[StiffnessFigure, ...]:
        """Return the stiffness of the tool centre point at a posture, without load.

        Parameters
        ----------
        q : ndarray, shape (joint,)
            In rad or m.
        T : ndarray, shape (4, 4)
            Tool centre point in base there.
        """
        model, c = self.model, self.compliance
        along = float(model.directional_rows(q, T[:3, 2]) @ c)
        ellipsoid = np.linalg.eigvalsh(model.cartesian_compliance(c, q).translation)
        rows = (
            ("along the tool's axis", along),
            ("in the softest direction", float(ellipsoid[-1])),
            ("in the stiffest direction", float(ellipsoid[0])),
        )
        return tuple(
            StiffnessFigure(name, _stiffness_text(compliance)) for name, compliance in rows
        )

    def cases(
        self, q: FloatArray, T: FloatArray, levels: Mapping[str, FloatArray]
    ) -> tuple[CaseFigure, ...]:
        """Return the predicted deflection at a posture under each load case.

        Parameters
        ----------
        q, T
            As for `stiffness`.
        levels : mapping
            Force on the robot in each case, tcp frame, shape (3,), in N.
        """
        force_tcp = np.array(list(levels.values()))
        rows, force = np.tile(q, (len(force_tcp), 1)), force_tcp @ T[:3, :3].T
        intervals: list[tuple[str, ...]] = [()] * len(levels)
        caveats = [""] * len(levels)
        if self.calibrated is None:
            deflection = self.model.deflection(self.compliance, rows, force)
        else:
            found = self.calibrated.predict(rows, force)
            deflection = found.deflection
            ends = zip(found.measured_low, found.measured_high, strict=True)
            intervals = [_interval_texts(low, high) for low, high in ends]
            caveats = _caveats(self.calibrated, rows, force)
        return tuple(
            CaseFigure(
                name=name,
                force=f"{_round(load)} N",
                size=mm(float(np.linalg.norm(each))),
                parts=tuple(f"{in_unit(part, 'mm') + 0.0:.3f}" for part in each),
                intervals=ends_of,
                deflection=triple(each),
                caveat=caveat,
            )
            for (name, load), each, ends_of, caveat in zip(
                levels.items(), deflection, intervals, caveats, strict=True
            )
        )


def _caveats(calibrated: CalibratedModel, q: FloatArray, force: FloatArray) -> list[str]:
    """Return for each row what of it was not calibrated, in words; empty where all of it was."""
    found = calibrated.covered_rows(q, force)
    if found is None:
        return ["where this model was calibrated is not known: the interval may not hold here"] * (
            len(q)
        )
    return [
        ""
        if near and within
        else f"{_NOT_CALIBRATED[near, within]} not calibrated: the interval may not hold here"
        for near, within in zip(found.near.tolist(), found.within_load.tolist(), strict=True)
    ]


def calibrated_springs(calibrated: CalibratedModel, file: str) -> StudioSprings:
    """Return the springs of a calibrated model, named after its file."""
    source = f"calibrated model {file}, with 95 % intervals of a measurement"
    return StudioSprings(calibrated.model, calibrated.compliance, source, calibrated)


def default_springs(cell: Cell) -> StudioSprings:
    """Return a spring a joint by rule of thumb, for a cell that is not calibrated yet.

    A gear winds up by `WIND_UP` under the torque that its joint may use; where that is not known,
    under the largest load case at the arm's full reach. Good for comparing postures; the size may
    be wrong by a factor of three.
    """
    robot = cell.robot
    largest = max(float(np.linalg.norm(force)) for force in cell.file.presses.values())
    torque = np.where(
        np.isfinite(cell.torque_limits), cell.torque_limits, largest * arm_reach(robot)
    )
    stiffness = np.where(robot.revolute, torque / WIND_UP, DRIVE)
    source = (
        "default springs, not calibrated: one per joint, whose gear winds up"
        f" {quantity(WIND_UP, 'mrad')} under the torque it may use. Sizes may be"
        " wrong by a factor of 3"
    )
    return StudioSprings(ElasticModel(robot, layout(robot, "actuated")), 1.0 / stiffness, source)


def _stiffness_text(compliance: float) -> str:
    if not compliance > _RIGID:
        return "rigid in this model"
    return f"{_MICROMETRES / compliance:.3g} N/µm"


def _interval_texts(low: FloatArray, high: FloatArray) -> tuple[str, ...]:
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        return ()
    return tuple(
        f"{in_unit(a, 'mm'):.3f} to {in_unit(b, 'mm'):.3f}" for a, b in zip(low, high, strict=True)
    )


def _round(force: FloatArray) -> str:
    return ", ".join(f"{part + 0.0:.0f}" for part in force)
