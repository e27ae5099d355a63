"""Indices in files: correlations in ``codec.json``, values in the table ``indices.csv``."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from elastocal.codec.data import CodecData
from elastocal.codec.index_correlation import Correlation
from elastocal.codec.indices import COVERING_RADIUS, INDICES, IndexValues
from elastocal.files import write_text
from elastocal.records import StrictModel

_TABLE = "indices.csv"
"""Name of the table in a codec's folder."""


class IndexRecord(StrictModel):
    """One rank correlation of an index with accuracy; see `index_correlation`."""

    variant: str
    index: str
    error: str
    kind: str
    correlation: float | None
    """Of the index, turned so that more is better, with accuracy; none where it never varies."""
    low: float | None
    high: float | None


def index_records(correlations: Sequence[Correlation]) -> tuple[IndexRecord, ...]:
    """Return correlations as `codec.json` keeps them under ``indices``."""
    return tuple(
        IndexRecord(
            variant=each.variant,
            index=each.index,
            error=each.error,
            kind=each.kind,
            correlation=_known(each.value),
            low=_known(each.low),
            high=_known(each.high),
        )
        for each in correlations
    )


def write_index_table(folder: Path, data: CodecData, indices: Sequence[IndexValues]) -> Path:
    """Write ``indices.csv`` into a folder, atomically; return its path.

    A row a training set: its variant, the pose its verification set was grown from, its size,
    its indices, and the mean and largest error norm at the held-out poses.

    Parameters
    ----------
    folder : Path
        An existing folder.
    data : CodecData
        The codec.
    indices : sequence of IndexValues
        Of its variants.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    names = [f"{name}[m]" if name == COVERING_RADIUS else name for name in INDICES]
    table.writerow(["variant", "seed_pose", "n_train", *names, "error_mean[m]", "error_max[m]"])
    for each in indices:
        errors = [data.errors(each.variant, which) for which in ("mean", "max")]
        columns = [*(each.values[name] for name in INDICES), *errors]
        for cv, n in np.ndindex(columns[0].shape):
            numbers = [repr(float(column[cv, n])) for column in columns]
            table.writerow([each.variant, data.seed_pose[cv], data.n_train[n], *numbers])
    path = Path(folder) / _TABLE
    write_text(path, text.getvalue())
    return path


def _known(value: float) -> float | None:
    return None if np.isnan(value) else float(value)
