"""What a calibration says of itself: the figures of ``calibrate --json``.

The same dictionary is printed, stored in the model file and turned into tables, so that no two
places can disagree. All numbers are SI.
"""

from typing import Any

import numpy as np

from elastocal.dataset import Readings
from elastocal.identification.calibration import Calibration
from elastocal.identification.held_out import HeldOut
from elastocal.identification.suspicious import Screening

SCHEMA = "elastocal.calibration/1"


def summary(calibration: Calibration) -> dict[str, Any]:
    """Return the figures of a calibration as JSON-ready data (spec section 4)."""
    calibrated = calibration.calibrated
    seen = calibrated.observability
    residual, deflection = calibration.residual_norm, calibration.deflection_norm
    return {
        "schema": SCHEMA,
        "robot": calibrated.model.robot.name,
        "springs": springs(calibration),
        "rank": seen.rank,
        "rank_attainable": calibration.attainable_rank,
        "springs_total": seen.springs,
        "condition": seen.condition,
        "unobservable": [
            [{"spring": term.spring, "weight": term.weight} for term in group]
            for group in seen.unobservable
        ],
        "residual": {
            "mean": float(residual.mean()),
            "max": float(residual.max()),
            "p95": float(np.percentile(residual, 95)),
            "rms_axis": _rms(calibration.residual[calibration.used]),
        },
        "deflection": {"mean": float(deflection.mean()), "max": float(deflection.max())},
        "readings": len(residual),
        "poses": calibration.poses,
        "suspicious": suspicious(calibration.readings, calibration.screening, calibration.used),
        "held_out": _held_out(calibration.held_out),
        "comparison": _comparison(calibration),
        "draws": len(calibrated.draws),
        "interval_widening": calibration.widening,
        "warnings": list(calibration.warnings),
    }


def springs(calibration: Calibration) -> list[dict[str, Any]]:
    """Return a row a spring: compliance with its 95 % interval, and whether it is observable."""
    calibrated = calibration.calibrated
    low, high = calibrated.interval()
    named = ((spring, each) for spring in calibrated.model.springs for each in spring.parameters)
    return [
        {
            "name": parameter.name,
            "kind": spring.kind,
            "unit": parameter.unit.si,
            "compliance": float(calibrated.compliance[i]),
            "low": float(low[i]),
            "high": float(high[i]),
            "observable": calibrated.observability.observable[i],
        }
        for i, (spring, parameter) in enumerate(named)
    ]


def suspicious(readings: Readings, screening: Screening, used: Any) -> list[dict[str, Any]]:
    """Return the readings that look wrong, the worst first."""
    order = np.argsort(-screening.score, kind="stable")
    return [
        {
            "pose": int(readings.pose[i]),
            "load_case": str(readings.load_case[i]),
            "score": float(screening.score[i]),
            "residual": float(screening.residual[i]),
            "leverage": float(screening.leverage[i]),
            "set_aside": not bool(used[i]),
        }
        for i in order
        if screening.suspicious[i]
    ]


def _held_out(held_out: HeldOut) -> dict[str, Any]:
    return {
        "mean": held_out.mean,
        "max": held_out.max,
        "readings": len(held_out.error),
        "folds": held_out.folds,
        "misfit": held_out.misfit if np.isfinite(held_out.misfit) else None,
        "split": "leave-poses-out",
    }


def _comparison(calibration: Calibration) -> dict[str, Any] | None:
    other = calibration.comparison
    if other is None:
        return None
    return {
        "springs": other.layout,
        "held_out": _held_out(other.held_out),
        "difference": {"mean": other.difference, "low": other.low, "high": other.high},
    }


def _rms(residual: Any) -> list[float]:
    return [float(value) for value in np.sqrt(np.mean(np.square(residual), axis=0))]
