"""Plausibility: the unit mistakes of the shop floor, told apart from blunders (spec section 6).

Degrees in a radian column or millimetres in a metre column shift *every* number by a factor;
a broken beam shifts one. Displacements and forces are therefore judged by their median over
the usable readings, which a single blunder cannot move; the fit names the blunder.
"""

import math

import numpy as np
import xarray as xr

from elastocal.dataset.layout import JOINT_POSITION, FloatArray
from elastocal.dataset.validation import place, usable
from elastocal.errors import DatasetError

MAX_JOINT_ANGLE = math.radians(2 * 350)
"""Largest plausible position of a revolute joint, in rad: twice the ±350° of a wrist's last
joint, the widest range in common use. Beyond it the column is in degrees."""

MAX_TRAVEL = 100.0
"""Largest plausible position of a prismatic joint or of the TCP, in m: no rail is longer.
Beyond it the column is in mm."""

MAX_MEDIAN_DISPLACEMENT = 0.1
"""Largest plausible median of a displacement under load, in m: arms deflect by millimetres."""

MAX_MEDIAN_FORCE = 50e3
"""Largest plausible median of a force, in N: the strongest arms carry 2.3 t (23 kN)."""

MIN_MEDIAN_COMPLIANCE = 1e-8
"""Smallest plausible deflection per force, in m/N: that of a stiff machine tool, 100 N/µm. An
arm has 2e-7 to 2e-5 m/N, so a deflection 1000 times too small falls below it."""

MAX_MEDIAN_COMPLIANCE = 2e-4
"""Largest plausible deflection per force, in m/N: 5 N/mm, softer than any collaborative arm."""


def check_plausible(data: xr.Dataset) -> None:
    """Refuse a dataset in canonical form whose numbers look like a unit mistake.

    Raises
    ------
    DatasetError
        Naming the quantity, its value, the limit and the mistake that it looks like.
    """
    ok = usable(data)
    force = _norms(data["force"].values[ok])
    marker, controller = (
        data[name].values[ok] for name in ("marker_displacement", "controller_displacement")
    )
    _check_joints(data)
    _check_tcp(data)
    _check_median("controller_displacement", _norms(controller), MAX_MEDIAN_DISPLACEMENT, "m", "mm")
    _check_median("marker_displacement", _norms(marker), MAX_MEDIAN_DISPLACEMENT, "m", "mm")
    _check_median("force", force, MAX_MEDIAN_FORCE, "N", "mN")
    _check_compliance(_norms(marker - controller), force)


def _norms(vectors: FloatArray) -> FloatArray:
    norms: FloatArray = np.linalg.norm(vectors, axis=-1)
    return norms


def _check_joints(data: xr.Dataset) -> None:
    positions = data["joint_position"].values
    prismatic = np.zeros(positions.shape[-1], dtype=bool)
    if "joint_unit" in data.coords:
        prismatic = data["joint_unit"].values == "m"
    limits = np.where(prismatic, MAX_TRAVEL, MAX_JOINT_ANGLE)
    beyond = ~(np.abs(positions) <= limits) & usable(data)[..., np.newaxis]
    for index in np.argwhere(beyond):
        unit, mistake = ("m", "mm") if prismatic[index[-1]] else ("rad", "degrees")
        raise DatasetError(
            f"{place(data, JOINT_POSITION, index)} is {positions[tuple(index)]:g} {unit}, beyond"
            f" ±{limits[index[-1]]:.4g} {unit}: looks like {mistake} in a column of {unit}"
        )


def _check_tcp(data: xr.Dataset) -> None:
    if "tcp_position" in data:
        measured = usable(data).any(axis=1)
        distances = _norms(data["tcp_position"].values[measured])
        _check_median("tcp_position", distances, MAX_TRAVEL, "m", "mm")


def _check_median(name: str, norms: FloatArray, limit: float, unit: str, mistake: str) -> None:
    median = float(np.median(norms))
    if not median <= limit:
        raise DatasetError(
            f"{name} has a median norm of {median:g} {unit} over {len(norms)} readings, more than"
            f" {limit:g} {unit}: looks like {mistake} in a column of {unit}"
        )


def _check_compliance(deflection: FloatArray, force: FloatArray) -> None:
    if not force.any():
        raise DatasetError(f"force is zero in all {len(force)} usable readings: nothing to fit")
    if not deflection.any():
        raise DatasetError(
            f"marker_displacement equals controller_displacement in all {len(force)} usable"
            " readings: the deflection is zero, as if one had been copied from the other"
        )
    # Unloaded readings say nothing about the ratio.
    loaded = force > 0
    compliance = float(np.median(deflection[loaded]) / np.median(force[loaded]))
    if MIN_MEDIAN_COMPLIANCE <= compliance <= MAX_MEDIAN_COMPLIANCE:
        return
    if compliance > MAX_MEDIAN_COMPLIANCE:
        mistake = "softer than any robot: looks like kN in a column of N, or mm in a column of m"
    else:
        mistake = "stiffer than any robot: looks like m in a column of mm, or N in a column of kN"
    raise DatasetError(
        f"median deflection per median force is {compliance:g} m/N over {int(loaded.sum())} loaded"
        f" readings, outside {MIN_MEDIAN_COMPLIANCE:g} to {MAX_MEDIAN_COMPLIANCE:g} m/N: {mistake}"
    )
