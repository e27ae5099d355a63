"""Recertification: has a cell changed between two calibrations, and does it matter?"""

from elastocal.identification.recertification.recertify import recertify
from elastocal.identification.recertification.result import (
    DeflectionChange,
    Estimate,
    Recertification,
    SpringChange,
    Verdict,
)

__all__ = [
    "DeflectionChange",
    "Estimate",
    "Recertification",
    "SpringChange",
    "Verdict",
    "recertify",
]
