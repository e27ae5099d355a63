"""Identification of the compliances: build, solve, certify (paper Eq. 15-19)."""

from elastocal.identification.calibrated import CalibratedModel, Prediction
from elastocal.identification.calibration import Calibration, calibrate
from elastocal.identification.held_out import Comparison, HeldOut, leave_poses_out
from elastocal.identification.losses import LOSSES
from elastocal.identification.model_file import read_model, write_model
from elastocal.identification.observability import Observability, describe, observability
from elastocal.identification.options import FitOptions, Prior
from elastocal.identification.problem import Problem, build
from elastocal.identification.solve import Solution, solve
from elastocal.identification.summary import summary

__all__ = [
    "LOSSES",
    "CalibratedModel",
    "Calibration",
    "Comparison",
    "FitOptions",
    "HeldOut",
    "Observability",
    "Prediction",
    "Prior",
    "Problem",
    "Solution",
    "build",
    "calibrate",
    "describe",
    "leave_poses_out",
    "observability",
    "read_model",
    "solve",
    "summary",
    "write_model",
]
