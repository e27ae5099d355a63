"""The sections of the report, in their order. The verdict comes before them; see `verdict`."""

from elastocal.report.document.section import Section
from elastocal.report.document.sections import (
    cell,
    codecs,
    compliances,
    instruments,
    not_verified,
    poses,
    process,
    provenance,
    readings,
    recertification,
)

SECTIONS: tuple[Section, ...] = (
    cell.SECTION,
    poses.SECTION,
    readings.SECTION,
    instruments.SECTION,
    compliances.SECTION,
    codecs.SECTION,
    process.SECTION,
    recertification.SECTION,
    provenance.SECTION,
    not_verified.SECTION,
)
"""A new section is one file and one entry here."""
