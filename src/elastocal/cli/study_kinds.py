"""The files of a study, as ``elastocal check`` tells of them."""

from pathlib import Path
from typing import Any

from elastocal.codec.study import (
    DESIGN,
    DESIGN_SCHEMA,
    PART_SCHEMA,
    PARTS,
    STUDY_SCHEMA,
    StudyDesign,
    StudyStore,
    read_design,
    read_part,
    read_study,
)

Described = tuple[str, dict[str, Any]]


def is_study(folder: Path) -> bool:
    """Return whether a folder is that of a study."""
    return (folder / DESIGN).is_file() and (folder / PARTS).is_dir()


def study_folder(path: Path) -> Described:
    """Describe the folder of a study; every finished sample is validated.

    Raises
    ------
    ElastocalError
        If settings or a sample are damaged.
    """
    settings = read_design(path / DESIGN)
    done = StudyStore(path).finished(settings)
    return "study", {"schema": DESIGN_SCHEMA, **_facts(settings), "samples": len(done)}


def study_settings(path: Path) -> Described:
    """Describe what a study is a study of."""
    return "settings file of a study", {"schema": DESIGN_SCHEMA, **_facts(read_design(path))}


def study_samples(path: Path) -> Described:
    """Describe some finished samples, by the settings in the folder above theirs."""
    results = read_part(path, read_design(path.resolve().parent.parent / DESIGN))
    return "part of a study", {
        "schema": PART_SCHEMA,
        "samples": [result.number for result in results],
        "conditions": len(results[0].outcomes) if results else 0,
    }


def study_record(path: Path) -> Described:
    """Describe the results of a study."""
    record = read_study(path)
    return "record of a study", {
        "schema": STUDY_SCHEMA,
        "cell": record.cell,
        "samples": record.samples,
        "verification": record.verification,
        "median_error_m": {each.name: each.error_mean.median for each in record.conditions},
        "advice": record.advice or None,
    }


def _facts(settings: StudyDesign) -> dict[str, Any]:
    return {
        "cell": settings.cell,
        "seed": settings.seed,
        "conditions": list(settings.names),
        "verification": settings.verification,
    }
