"""From a stretch of the raw streams to one reading: mean, scatter and number of samples.

The standard deviation of a mean of ``n`` samples ``x`` with lag-1 autocorrelation ``r`` is that of
a first-order autoregressive process (Bayley and Hammersley 1946),

    sigma_mean = s sqrt(1 / n) sqrt((1 + r) / (1 - r)),

with ``r`` cut off below at 0; a sensor's own filter makes samples that are not independent.
"""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.procedure.pose_log import ReadingStatus, Window
from elastocal.procedure.streams import EDGE, Streams

LEAST_SAMPLES = 5
"""Fewer good samples than this make no reading: their scatter says nothing."""
MOST_CORRELATED = 0.99
"""Largest lag-1 autocorrelation that is believed; beyond it the samples drift."""


@dataclass(frozen=True, eq=False)
class Mean:
    """Mean of some samples."""

    value: FloatArray
    """Shape (component,)."""
    deviation: FloatArray
    """Standard deviation of one sample, shape (component,)."""
    sigma: FloatArray
    """Standard deviation of the mean, shape (component,); at least what the maker states for
    that many samples. 0 only where neither says anything."""
    count: int
    """Samples."""
    time: float
    """Mean time, in s of the clock."""


@dataclass(frozen=True, eq=False)
class ToolState:
    """Where the controller had the tool, and what the sensor felt."""

    q: FloatArray
    """Joint positions, shape (joint,), in rad or m."""
    T_base_tcp: FloatArray
    """Tool frame, shape (4, 4), in m."""
    force: Mean
    """Raw, sensor frame, in N."""
    moment: Mean
    """Raw, sensor frame, in N·m."""


@dataclass(frozen=True, eq=False)
class Reading:
    """What the devices said during one window."""

    window: Window
    """Its status is ``missing``, with a note, where a stream has too few good samples."""
    tool: ToolState | None
    """None where arm or sensor said too little."""
    marker: Mean | None
    """In the frame of the window's station, in m; None where the station said too little."""


def average(streams: Streams, window: Window) -> Reading:
    """Return the means of every stream over a window, its ends included.

    Parameters
    ----------
    streams : Streams
        Of the window's pose.
    window : Window
        When, and which station measured.

    Returns
    -------
    Reading
        A stream with fewer than `LEAST_SAMPLES` good samples has no mean, and an ok window is
        then ``missing``. Samples that are not finite, that the sensor calls bad, or that another
        station took are not good. One state of the arm is enough: it has no noise.
    """
    arm, wrench, points = streams.arm, streams.wrench, streams.points
    at_arm = _inside(arm.time, window)
    at_wrench = _inside(wrench.time, window) & wrench.ok & _finite(wrench.force, wrench.moment)
    at_point = _inside(points.time, window) & _finite(points.position)
    at_point &= points.station == (window.station or "")
    stated = wrench.force_sigma[at_wrench, None]
    force = _mean(wrench.time[at_wrench], wrench.force[at_wrench], stated)
    moment = _mean(wrench.time[at_wrench], wrench.moment[at_wrench])
    tool = None
    if at_arm.any() and force is not None and moment is not None:
        q, T = arm.q[at_arm].mean(axis=0), _mean_pose(arm.T_base_tcp[at_arm])
        tool = ToolState(q, T, force, moment)
    counts = {
        "states of the arm": (int(at_arm.sum()), 1),
        "wrenches": (int(at_wrench.sum()), LEAST_SAMPLES),
    }
    if window.station:
        counts[f"points of station {window.station}"] = (int(at_point.sum()), LEAST_SAMPLES)
    marker = _mean(points.time[at_point], points.position[at_point], points.sigma[at_point])
    return Reading(_judged(window, counts), tool, marker)


def _judged(window: Window, counts: dict[str, tuple[int, int]]) -> Window:
    """Return the window, missing where a stream has too few samples."""
    few = [
        f"{count} {what}, not {least}" for what, (count, least) in counts.items() if count < least
    ]
    if not few or window.status is not ReadingStatus.OK:
        return window
    note = "; ".join(([window.note] if window.note else []) + [f"only {text}" for text in few])
    return window.model_copy(update={"status": ReadingStatus.MISSING, "note": note})


def _inside(time: FloatArray, window: Window) -> BoolArray:
    inside: BoolArray = (time >= window.start - EDGE) & (time <= window.end + EDGE)
    return inside


def _finite(*arrays: FloatArray) -> BoolArray:
    return np.asarray(np.isfinite(np.hstack(arrays)).all(axis=1), dtype=bool)


def _mean(time: FloatArray, samples: FloatArray, stated: FloatArray | None = None) -> Mean | None:
    count = len(samples)
    if count < LEAST_SAMPLES:
        return None
    value = samples.mean(axis=0)
    deviation = samples.std(axis=0, ddof=1)
    sigma = deviation * np.sqrt(_inflation(samples - value) / count)
    if stated is not None and np.all(np.isfinite(stated)):
        sigma = np.maximum(sigma, np.sqrt((stated**2).mean(axis=0) / count))
    return Mean(value, deviation, sigma, count, float(time.mean()))


def _inflation(centred: FloatArray) -> FloatArray:
    """Return by how much correlation widens the variance of a mean, shape (component,)."""
    power = (centred**2).sum(axis=0)
    lagged = (centred[1:] * centred[:-1]).sum(axis=0)
    r = np.divide(lagged, power, out=np.zeros_like(power), where=power > 0)
    r = np.clip(r, 0.0, MOST_CORRELATED)
    inflation: FloatArray = (1.0 + r) / (1.0 - r)
    return inflation


def _mean_pose(T: FloatArray) -> FloatArray:
    """Return the mean of poses that hardly differ: mean position, nearest rotation."""
    mean: FloatArray = T.mean(axis=0)
    u, _, vt = np.linalg.svd(mean[:3, :3])
    mean[:3, :3] = u @ vt
    return mean
