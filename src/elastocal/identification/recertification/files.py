"""Compare two model files."""

from dataclasses import replace
from pathlib import Path

from numpy.typing import ArrayLike

from elastocal.errors import IdentificationError, RobotError, SpringError
from elastocal.identification.calibrated import CalibratedModel
from elastocal.identification.model_file import CalibrateResult, read_model
from elastocal.identification.recertification.caveats import load_caveat
from elastocal.identification.recertification.recertify import recertify
from elastocal.identification.recertification.result import Recertification
from elastocal.records import read_json


def recertify_files(
    old: Path,
    new: Path,
    q: ArrayLike | None = None,
    force: ArrayLike | None = None,
    moment: ArrayLike | None = None,
    *,
    limit: float | None = None,
) -> Recertification:
    """Compare two model files; as `recertify`, with a note where the loads were others.

    Parameters
    ----------
    old, new : Path
        Model files of `elastocal calibrate`.
    q, force, moment, limit
        As for `recertify`.

    Raises
    ------
    SchemaError, FileAccessError
        If a file is no model or cannot be read.
    IdentificationError, SpringError, RobotError
        See `recertify`.
    """
    if Path(old).resolve() == Path(new).resolve():
        raise IdentificationError(f"{old} and {new} are one and the same file: nothing to compare")
    found = recertify(
        _model(old),
        _model(new),
        q,
        force,
        moment,
        limit=limit,
        names=(str(old), str(new)),
    )
    note = load_caveat(*(_measured_deflection(path) for path in (old, new)))
    return found if note is None else replace(found, notes=(*found.notes, note))


def _model(path: Path) -> CalibratedModel:
    """Return the model of a file; of two files, a refusal has to say which."""
    try:
        return read_model(path)
    except (SpringError, RobotError) as error:
        raise type(error)(f"{path}: {error}") from error


def _measured_deflection(path: Path) -> float | None:
    """Return the mean measured deflection that a model file states, in m; None: none."""
    figures = read_json(path, CalibrateResult).calibration
    return None if figures is None else figures.deflection.mean
