"""Recertification: whether a cell has changed between two calibrations, and whether it matters."""

from elastocal.identification.recertification.files import recertify_files
from elastocal.identification.recertification.recertify import recertify
from elastocal.identification.recertification.record import (
    ComparisonRecord,
    comparison_record,
    read_comparison,
    write_comparison,
)
from elastocal.identification.recertification.result import (
    DeflectionChange,
    Estimate,
    Recertification,
    SpringChange,
    Verdict,
)

__all__ = [
    "ComparisonRecord",
    "DeflectionChange",
    "Estimate",
    "Recertification",
    "SpringChange",
    "Verdict",
    "comparison_record",
    "read_comparison",
    "recertify",
    "recertify_files",
    "write_comparison",
]
