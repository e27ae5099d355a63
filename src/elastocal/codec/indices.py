"""The indices of each training set: how good it ought to be, by what is known beforehand."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.codec._training import PreparedVariant
from elastocal.codec.data import CodecData
from elastocal.planning.search import Candidates, build_information, covering_radius
from elastocal.planning.search.criteria import CRITERIA, IOptimal
from elastocal.results import brief_repr
from elastocal.tables import write_table

COVERING_RADIUS = "covering_radius"
INDICES = ("o1", "o2", "o3", "o4", "o5", "d", "a", "e", "i", COVERING_RADIUS)
"""Names, in the order of tables."""
_PLAIN = ("o2", "o3", "o4", "o5", "d", "a", "e")
"""Those that need the information matrix alone."""
_TABLE = "indices.csv"
"""Name of the table in a codec's folder."""


@brief_repr
@dataclass(frozen=True, eq=False)
class IndexValues:
    """Indices of the training sets of one variant."""

    variant: str
    values: dict[str, FloatArray]
    """By the names of `INDICES`, each of shape (cv, n_train). Values as their criteria define
    them, larger is better; only of the covering radius, in m, less is better."""

    def goodness(self, name: str) -> FloatArray:
        """Return an index turned so that more is better, shape (cv, n_train)."""
        sign = -1.0 if name == COVERING_RADIUS else 1.0
        return sign * self.values[name]


def index_values(data: CodecData, prepared: PreparedVariant) -> IndexValues:
    """Return the indices of all training sets of a variant.

    All sets are measured by one rule: over the directions that all poses together observe under
    the variant's load cases, columns scaled over all poses (spec section 2, trap 2). O1 is
    Eq. 20 of the paper. For ``i``, the verification poses of the split under all load cases
    stand for the production. The covering radius is that over all poses of the codec.

    Parameters
    ----------
    data : CodecData
        The codec.
    prepared : PreparedVariant
        The variant; from `prepared_variants`.

    Raises
    ------
    PlanningError
        If the forces load no spring.
    """
    number = data.index(prepared.variant.name)
    poses, everything = np.arange(len(data.contact)), np.ones_like(prepared.trains)
    rows = prepared.rows(poses, everything)
    pool = Candidates(data.contact, prepared.rows(poses, prepared.trains))
    information = build_information(pool)
    member = _members(data, number)
    flat = information.gram.reshape(len(poses), -1)
    shape = (*member.shape[:2], information.rank, information.rank)
    matrix = (member.astype(float) @ flat).reshape(shape) + information.matrix([])
    values = {name: CRITERIA[name]().value(matrix) for name in _PLAIN}
    values["o1"] = values["d"] / np.sqrt(information.rows_per_pose * data.n_train)
    values["i"] = np.stack(
        [
            IOptimal(_process(rows[held_out], information.scale, information.basis)).value(sets)
            for held_out, sets in zip(data.verification, matrix, strict=True)
        ]
    )
    values[COVERING_RADIUS] = np.array(
        [[covering_radius(pool, np.flatnonzero(one)) for one in sets] for sets in member]
    )
    return IndexValues(prepared.variant.name, {name: values[name] for name in INDICES})


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
    names = [f"{name}[m]" if name == COVERING_RADIUS else name for name in INDICES]
    header = ["variant", "seed_pose", "n_train", *names, "error_mean[m]", "error_max[m]"]
    path = Path(folder) / _TABLE
    write_table(path, header, (row for each in indices for row in _rows(data, each)))
    return path


def _rows(data: CodecData, indices: IndexValues) -> Iterator[list[object]]:
    """Yield the row of each training set of a variant."""
    errors = [data.errors(indices.variant, which) for which in ("mean", "max")]
    columns = [*(indices.values[name] for name in INDICES), *errors]
    for cv, n in np.ndindex(columns[0].shape):
        numbers = [float(column[cv, n]) for column in columns]
        yield [indices.variant, data.seed_pose[cv], data.n_train[n], *numbers]


def _process(rows: FloatArray, scale: FloatArray, basis: FloatArray) -> FloatArray:
    """Return the mean of ``z z^T`` over the rows of some poses, scaled and projected."""
    seen = (rows.reshape(-1, rows.shape[2]) / scale) @ basis
    return np.asarray(seen.T @ seen / len(seen))


def _members(data: CodecData, number: int) -> BoolArray:
    """Return which poses are in each training set, shape (cv, n_train, pose)."""
    chosen = data.chosen[number]
    return np.asarray((chosen[..., None] == np.arange(len(data.contact))).any(axis=2))
