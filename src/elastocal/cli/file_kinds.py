"""The kinds of file that ``elastocal check`` knows, by suffix."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from elastocal.cli import codec_kinds, model_kinds, run_kinds, study_kinds
from elastocal.compensation.process import TABLE
from elastocal.errors import DatasetError, SchemaError
from elastocal.files import read_text
from elastocal.planning import PLAN
from elastocal.procedure import JOURNAL
from elastocal.records import read_arrays

Facts = dict[str, Any]
Described = tuple[str, Facts]
"""The kind of a file and what it holds."""
Describe = Callable[[Path], Described]

_IN_JSON = re.compile(r'"schema":\s*"(elastocal\.[\w-]+)/')
_IN_YAML = re.compile(r"^schema:\s*[\"']?(elastocal\.[\w-]+)/", re.MULTILINE)


def describe_file(path: Path) -> Described:
    """Return the kind of a file, or of a folder that a command made, and what it holds.

    Raises
    ------
    SchemaError
        If the suffix is not one of ours, or a folder holds nothing of ours.
    ElastocalError
        If the contents are not valid.
    """
    if path.is_dir():
        return _folder(path)
    known: dict[str, Describe] = {
        ".nc": _netcdf,
        ".csv": _table,
        ".json": _json,
        ".urdf": model_kinds.robot_file,
        ".jsonl": run_kinds.journal_file,
        ".mcap": run_kinds.streams_file,
        ".yaml": _settings,
        ".yml": _settings,
    }
    describe = known.get(path.suffix.lower())
    if describe is None:
        raise SchemaError(f"{path}: suffix {path.suffix!r} is not one of {', '.join(known)}")
    return describe(path)


def _folder(path: Path) -> Described:
    """Describe the folder of a plan, a run, a simulated process, a codec or a study."""
    if (path / PLAN).is_file():
        return run_kinds.plan_file(path / PLAN)
    if (path / JOURNAL).is_file():
        return run_kinds.run_folder(path)
    if (path / TABLE).is_file():
        return model_kinds.process_folder(path)
    if study_kinds.is_study(path):
        return study_kinds.study_folder(path)
    if codec_kinds.is_codec(path):
        return codec_kinds.codec_folder(path)
    raise SchemaError(
        f"{path} is a folder with none of {PLAN}, {JOURNAL}, {TABLE} in it, nor the files of a"
        " codec or a study"
    )


def _netcdf(path: Path) -> Described:
    """Describe a NetCDF file by the schema that it states."""
    try:
        stated = read_arrays(path).attributes.get("schema")
    except SchemaError as error:
        raise DatasetError(str(error)) from error
    kinds: dict[str, Describe] = {
        "elastocal.codec": codec_kinds.arrays,
        "elastocal.pool": run_kinds.pool_file,
    }
    return kinds.get(str(stated).partition("/")[0], run_kinds.dataset_file)(path)


def _json(path: Path) -> Described:
    """Describe a JSON file by the schema that it states; what states none is read as a model."""
    kinds: dict[str, Describe] = {
        "elastocal.plan": run_kinds.plan_file,
        "elastocal.run-summary": run_kinds.summary_file,
        "elastocal.tool": model_kinds.tool_file,
        "elastocal.codec_verdicts": codec_kinds.verdicts,
        "elastocal.study": study_kinds.study_record,
        "elastocal.study_settings": study_kinds.study_settings,
        "elastocal.study_samples": study_kinds.study_samples,
        "elastocal.process": model_kinds.process_table,
        "elastocal.comparison": model_kinds.comparison_file,
    }
    return kinds.get(_stated(_IN_JSON, read_text(path)[:200]), model_kinds.model_file)(path)


def _table(path: Path) -> Described:
    return codec_kinds.table(path) if codec_kinds.is_table(path) else run_kinds.dataset_file(path)


def _stated(pattern: re.Pattern[str], text: str) -> str:
    """Return the schema that a text states, without its version; empty when it states none."""
    found = pattern.search(text)
    return found[1] if found else ""


def _settings(path: Path) -> Described:
    """Describe a YAML file by the schema that it states."""
    kinds: dict[str, Describe] = {
        "elastocal.cell": run_kinds.cell_file,
        "elastocal.compensator": model_kinds.compensator_file,
    }
    return kinds.get(_stated(_IN_YAML, read_text(path)), model_kinds.springs_file)(path)
