"""The dataset of spec section 3 from the rows of all poses."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.dataset import STATUSES, Dataset
from elastocal.procedure.displacement import LoadRow, Numbers
from elastocal.procedure.pose_log import ReadingStatus
from elastocal.robot import Robot

_VECTORS = ("force", "controller_displacement", "marker_displacement")
_SIGMAS = ("force_sigma", "marker_sigma")


def make_dataset(
    rows: Sequence[LoadRow],
    load_cases: Sequence[str],
    robot: Robot,
    tcp_position: Mapping[int, FloatArray],
    attributes: Mapping[str, Any],
) -> Dataset:
    """Return the dataset of a run.

    The moment is left out: the paper's row takes the force alone, and a moment that is moved from
    the sensor to the tcp carries the sensor's place and cross-talk with the arm of the tool.

    Parameters
    ----------
    rows : sequence of LoadRow
        Of all poses, in order.
    load_cases : sequence of str
        Those to keep.
    robot : Robot
        The arm with its tool.
    tcp_position : mapping of int to ndarray, shape (3,)
        Unloaded place of the tcp at each pose, in base, in m.
    attributes : mapping
        Other keywords of `Dataset.from_arrays`.

    Raises
    ------
    DatasetError
        If there is no usable reading.
    """
    poses = tuple(dict.fromkeys(row.pose for row in rows))
    shape = (len(poses), len(load_cases))
    arrays: dict[str, Any] = {name: np.full((*shape, 3), np.nan) for name in (*_VECTORS, *_SIGMAS)}
    arrays["joint_position"] = np.full((*shape, len(robot.joint_names)), np.nan)
    status = np.full(shape, STATUSES.index(ReadingStatus.MISSING.value))
    for row in rows:
        if row.load_case not in load_cases:
            continue
        place = poses.index(row.pose), list(load_cases).index(row.load_case)
        status[place] = STATUSES.index(row.status.value)
        for name, values in _values(row.numbers).items():
            arrays[name][place] = values
    ok = status == STATUSES.index(ReadingStatus.OK.value)
    sigmas = {name: arrays.pop(name) for name in _SIGMAS}
    known: dict[str, Any] = {name: sigma for name, sigma in sigmas.items() if np.all(sigma[ok] > 0)}
    unknown = np.full(3, np.nan)
    return Dataset.from_arrays(
        **arrays,
        **known,
        joint_names=robot.joint_names,
        joint_units=["rad" if revolute else "m" for revolute in robot.revolute],
        load_cases=load_cases,
        poses=poses,
        status=status,
        tcp_position=np.array([tcp_position.get(pose, unknown) for pose in poses]),
        robot_name=robot.name,
        robot_urdf=robot.urdf,
        tcp_frame=robot.tip,
        **attributes,
    )


def _values(numbers: Numbers | None) -> dict[str, FloatArray]:
    if numbers is None:
        return {}
    return {
        "joint_position": numbers.q,
        "force": numbers.wrench.force,
        "controller_displacement": numbers.controller_displacement,
        "marker_displacement": numbers.marker_displacement,
        "force_sigma": numbers.force_sigma,
        "marker_sigma": numbers.marker_sigma,
    }
