"""Residuals by which offsets of a clock that fit the motion equally well are told apart.

At a wrong offset the weight of the tool does not turn with the arm, the marker is at other places
than the arm carries it to, and the arm deflects otherwise than one elastic arm would. Every
residual is a median, shape (offset,); infinite at offsets at which too little is common to both
logs.
"""

from collections.abc import Sequence

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.elastic import ElasticModel, actuated
from elastocal.errors import present
from elastocal.logs.map import Site
from elastocal.logs.streams import LogStreams
from elastocal.procedure.record import ArmStream, PointStream, WrenchStream
from elastocal.robot import nearest_rotation

PRESSING = 2e-3
"""Speed in m/s above which an arm travels; below, it is at rest or yields to a force."""
LONGEST_GAP = 1.0
"""Time without a sample from which on nothing is known of a log, in s."""
_TRAVELLING = 10e-3
"""Speed in m/s above which the tool touches nothing."""
_LEAST_SAMPLES = 20
"""Samples by which an offset is judged."""
_MOST_SAMPLES = 800
"""Samples that are enough to judge it."""
_PLAINLY = 0.5
"""Part of the residual below which another unit or a left-handed frame is plainly the better
explanation: the motion of other joints is a little better explained by nearly any."""


def misfits(
    log: LogStreams,
    reference: LogStreams,
    shifts: FloatArray,
    site: Site,
    markers: Sequence[LogStreams],
) -> FloatArray:
    """Return how badly one arm explains a log at each offset of its clock, shape (offset,).

    Of a log of forces it is the product of the residuals of weight and deflection, as of two
    measurements whose noise is unknown; only ratios have a meaning.

    Parameters
    ----------
    log, reference : LogStreams
        A log of forces or of a marker, and that of the joints.
    shifts : ndarray, shape (offset,)
        Offsets to be added to the times of the log, in s.
    site : Site
        Robot, sensor and marker.
    markers : sequence of LogStreams
        Logs of markers by the clock of the joints.
    """
    if log.wrench is None:
        return np.array([_rigid_misfit(log, reference, each, site.marker) for each in shifts])
    found = np.array([weight_misfit(log, reference, each) for each in shifts])
    for each in markers:
        arm, points = present(reference.arm, "arm"), present(each.points, "points")
        deflections = _Deflections(arm, points, log.entry.frame, site)
        bent = np.array([deflections.misfit(log.wrench, shift) for shift in shifts])
        if np.isfinite(bent).any():
            found = np.where(np.isfinite(found), found, 1.0) * bent
    return found


def weight_misfit(log: LogStreams, reference: LogStreams, shift: float) -> float:
    """Return the residual of the force while the arm travels, explained by weight alone, in N.

    The model is ``F = A R_base_tcp^T g + b`` with any ``A``, so that the sensor may have any
    rotation; the median residual is returned.
    """
    arm, wrench = present(reference.arm, "arm"), present(log.wrench, "wrench")
    time = arm.time
    own = time[_speed(arm) > _TRAVELLING] - shift
    own = own[(own > wrench.time[0]) & (own < wrench.time[-1])]
    after = np.searchsorted(wrench.time, own)
    # Across a gap the next sample belongs to another posture.
    near = wrench.time[after] - own <= LONGEST_GAP
    near &= np.isfinite(wrench.force[after]).all(axis=1)
    own, after = own[near], after[near]
    if len(own) < _LEAST_SAMPLES:
        return np.inf
    force = wrench.force[after]
    down = arm.T_base_tcp[np.searchsorted(time, own + shift).clip(0, len(time) - 1), 2, :3]
    return _residual(np.column_stack([down, np.ones(len(down))]), force)


def _rigid_misfit(log: LogStreams, reference: LogStreams, shift: float, lever: FloatArray) -> float:
    """Return how far the marker is from where the arm carries it, in m."""
    arm, points = present(reference.arm, "arm"), present(log.points, "points")
    place, known = _interpolated(points.time + shift, points.position, arm.time)
    there = (arm.T_base_tcp[:, :3, 3] + arm.T_base_tcp[:, :3, :3] @ lever)[known]
    if len(there) < _LEAST_SAMPLES:
        return np.inf
    return _median_length(there - _brought(place[known], there))


def _brought(here: FloatArray, there: FloatArray) -> FloatArray:
    """Return points of a tracker brought to those of the arm, shape (sample, 3), in m.

    Where that is plainly better their unit and handedness are free (S. Umeyama, "Least-squares
    estimation of transformation parameters between two point patterns", IEEE Transactions on
    Pattern Analysis and Machine Intelligence 13, 1991): a mistake in them does not hide the clock,
    which is needed to name it.
    """
    middle = there.mean(axis=0)
    a, b = here - here.mean(axis=0), there - middle
    M, size = b.T @ a, float((a**2).sum())
    turn = nearest_rotation(M)
    stated = middle + a @ turn.T
    others = [middle + float((Q * M).sum()) / size * a @ Q.T for Q in (turn, -nearest_rotation(-M))]
    best = min(others, key=lambda each: _median_length(there - each))
    plainly = _median_length(there - best) < _PLAINLY * _median_length(there - stated)
    return np.asarray(best if plainly else stated)


def _median_length(values: FloatArray) -> float:
    """Return the median norm of vectors, shape (sample, 3)."""
    return float(np.median(np.linalg.norm(values, axis=1)))


class _Deflections:
    """Deflections of the arm at rest and how each spring would deflect it, pose by pose.

    Means over each pose are taken off, with them the zero of the sensor, the weight, and errors
    of geometry. A force bends one arm at all poses: ``deflection = sum_j c_j a_j(q) force`` (paper
    Eq. 11), with compliances ``c_j`` that are fitted.
    """

    def __init__(self, arm: ArmStream, points: PointStream, frame: str, site: Site) -> None:
        speed = _speed(arm)
        place, known = _interpolated(points.time, points.position, arm.time)
        rows = np.flatnonzero(known & (speed < PRESSING))
        rows = rows[:: max(len(rows) // _MOST_SAMPLES, 1)]
        self.time = arm.time[rows]
        self._pose = np.cumsum(np.diff(speed > _TRAVELLING, prepend=False))[rows]
        if len(rows) < _LEAST_SAMPLES:
            return
        R = arm.T_base_tcp[rows, :3, :3]
        here, there = place[rows], arm.T_base_tcp[rows, :3, 3] + R @ site.marker
        self._deflection = _brought(here, there) - there
        if frame == "base":
            R = np.broadcast_to(np.eye(3), R.shape)
        elif frame == "sensor":
            R = R @ site.sensor.T_tcp_sensor[:3, :3]
        model = ElasticModel(site.robot, actuated(site.robot))
        of_force = [
            model.observation_blocks(arm.q[rows], R[:, :, axis], None, site.marker)
            for axis in range(3)
        ]
        self._of_force = np.stack(of_force, axis=-1)

    def misfit(self, wrench: WrenchStream, shift: float) -> float:
        """Return the residual deflection over the deflection, both medians."""
        if len(self.time) < _LEAST_SAMPLES:
            return np.inf
        force, known = _interpolated(wrench.time + shift, wrench.force, self.time)
        if np.count_nonzero(known) < _LEAST_SAMPLES:
            return np.inf
        columns = np.einsum("nijk,nk->nij", self._of_force[known], force[known])
        _, pose = np.unique(self._pose[known], return_inverse=True)
        count = np.bincount(pose)[:, None]

        def varying(values: FloatArray) -> FloatArray:
            flat = values.reshape(len(values), -1)
            mean = np.zeros((len(count), flat.shape[1]))
            np.add.at(mean, pose, flat)
            return (flat - (mean / count)[pose]).reshape(values.shape)

        columns, deflection = varying(columns), varying(self._deflection[known])
        c, *_ = np.linalg.lstsq(columns.reshape(-1, columns.shape[2]), deflection.ravel())
        size, left = _median_length(deflection), _median_length(deflection - columns @ c)
        return left / size if size > 0.0 else np.inf


def _speed(arm: ArmStream) -> FloatArray:
    """Return the speed of the tcp, shape (sample,), in m/s."""
    steps = np.linalg.norm(np.gradient(arm.T_base_tcp[:, :3, 3], axis=0), axis=1)
    return np.asarray(steps / np.maximum(np.gradient(arm.time), 1e-9))


def _residual(columns: FloatArray, values: FloatArray) -> float:
    return _median_length(values - columns @ np.linalg.lstsq(columns, values)[0])


def _interpolated(
    time: FloatArray, values: FloatArray, wanted: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Return values, shape (sample, 3), at other times, and which of these no gap surrounds."""
    good = np.isfinite(values).all(axis=1)
    time, values = time[good], values[good]
    if len(time) < 2:
        return np.zeros((len(wanted), 3)), np.zeros(len(wanted), dtype=bool)
    found = np.column_stack([np.interp(wanted, time, axis) for axis in values.T])
    after = np.searchsorted(time, wanted).clip(1, len(time) - 1)
    inside = (wanted >= time[0]) & (wanted <= time[-1])
    return found, np.asarray(inside & (time[after] - time[after - 1] <= LONGEST_GAP))
