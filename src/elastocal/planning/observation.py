"""What the poses of a pool, and the production process, would show of the springs."""

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.elastic import ElasticModel, layout
from elastocal.planning.postures import Postures

SPRINGS = "bearing"
"""Spring layout that poses are judged by: the paper's 18 on a six-axis arm."""

_CHUNK = 5000


def elastic_model(cell: Cell) -> ElasticModel:
    """Return the elastic model whose springs are to be identified."""
    return ElasticModel(cell.robot, layout(cell.robot, SPRINGS))


def pose_rows(cell: Cell, model: ElasticModel, postures: Postures) -> FloatArray:
    """Return the observation rows of all load cases at each posture (paper Eq. 15, 17).

    Parameters
    ----------
    cell : Cell
        For its load cases.
    model : ElasticModel
        Of the cell's robot.
    postures : Postures
        In contact.

    Returns
    -------
    ndarray, shape (pose, row, spring)
        In m per unit of compliance; a row is an axis of a load case.
    """
    force_tcp = cell.file.load_cases.force_tcp
    rows = np.empty((len(postures), 3 * len(force_tcp), len(model.parameters)))
    for start in range(0, len(postures), _CHUNK):
        part = slice(start, start + _CHUNK)
        R_base_tcp = postures.T_base_tcp[part, :3, :3]
        force = np.einsum("pij,lj->pli", R_base_tcp, force_tcp)
        blocks = model.observation_blocks(postures.q[part, None], force)
        rows[part] = blocks.reshape(len(R_base_tcp), -1, len(model.parameters))
    return rows


def process_rows(cell: Cell, model: ElasticModel) -> FloatArray | None:
    """Return the rows at the production's poses and forces, shape (row, spring).

    In m per unit of compliance; None when the cell names no process.
    """
    process = cell.process
    if process is None:
        return None
    blocks = model.observation_blocks(process.joint_position, process.force, process.moment)
    return blocks.reshape(-1, len(model.parameters))
