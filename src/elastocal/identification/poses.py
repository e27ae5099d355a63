"""Pose blocks: which readings may not be separated.

Readings at one pose share what the model gets wrong there, so they are resampled and left out
together. A configuration that was measured twice under two labels is still one block; treated
as two it would be held out against itself.
"""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from elastocal.arrays import IndexArray
from elastocal.dataset import Readings
from elastocal.errors import IdentificationError

SAME_CONFIGURATION = 5e-3
"""Distance in joint space (rad, m) below which two poses are the same configuration: more than
the few millimetres that the controller travels under load, far less than the step between
calibration poses."""

MINIMUM_BLOCKS = 3
"""Fewest distinct poses: one to leave out and two to fit, so that the spread is seen."""


def pose_blocks(readings: Readings) -> IndexArray:
    """Return the block number of each reading, shape (reading,).

    Raises
    ------
    IdentificationError
        If there are fewer than `MINIMUM_BLOCKS` distinct configurations.
    """
    labels, pose = np.unique(readings.pose, return_inverse=True)
    counts = np.bincount(pose)
    centres = np.stack(
        [np.bincount(pose, column) / counts for column in readings.joint_position.T], axis=1
    )
    pairs = cKDTree(centres).query_pairs(SAME_CONFIGURATION, output_type="ndarray")
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(labels),) * 2)
    count, component = connected_components(graph, directed=False)
    if count < MINIMUM_BLOCKS:
        raise IdentificationError(
            f"the data hold {count} distinct joint configuration{'s' if count > 1 else ''}"
            f" ({len(labels)} pose labels): at least {MINIMUM_BLOCKS} are needed"
        )
    return np.asarray(component[pose], dtype=np.intp)


def same_configuration(readings: Readings, blocks: IndexArray) -> list[tuple[int, ...]]:
    """Return the groups of pose labels that are one configuration."""
    groups = (np.unique(readings.pose[blocks == block]) for block in np.unique(blocks))
    return [tuple(int(label) for label in group) for group in groups if len(group) > 1]
