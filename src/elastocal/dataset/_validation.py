"""Checks of the numbers of a dataset; its names and shapes are already right here.

Two kinds: numbers that a reading cannot have, and numbers that look like the unit mistakes of the
shop floor, told apart from blunders (spec section 6). Degrees in a radian column or millimetres in
a metre column shift *every* number by a factor; a broken beam shifts one. Displacements and forces
are therefore judged by their median over the usable readings, which a single blunder cannot move;
the fit names the blunder.
"""

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from elastocal.dataset._layout import (
    AXES,
    JOINT_POSITION,
    STATUSES,
    VARIABLES,
    BoolArray,
    FloatArray,
    Variable,
)
from elastocal.errors import DatasetError

if TYPE_CHECKING:
    from elastocal.dataset.dataset import Dataset

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


def check_numbers(data: "Dataset") -> None:
    """Refuse a dataset with an ok reading that is not finite, or with nothing to read.

    Raises
    ------
    DatasetError
        Naming variable, component, pose, load case and value of the first offence.
    """
    ok = data.usable
    _check_coverage(data, ok)
    for variable in VARIABLES:
        if variable.name in data.arrays:
            _check_finite(data, variable, ok)
            if variable.name.endswith("_sigma"):
                _check_positive(data, variable, ok)


def check_plausible(data: "Dataset") -> None:
    """Refuse a dataset whose numbers look like a unit mistake.

    Raises
    ------
    DatasetError
        Naming the quantity, its value, the limit and the mistake that it looks like.
    """
    ok = data.usable
    force = _norms(data.force[ok])
    marker, controller = data.marker_displacement[ok], data.controller_displacement[ok]
    _check_joints(data)
    _check_tcp(data)
    _check_median("controller_displacement", _norms(controller), MAX_MEDIAN_DISPLACEMENT, "m", "mm")
    _check_median("marker_displacement", _norms(marker), MAX_MEDIAN_DISPLACEMENT, "m", "mm")
    _check_median("force", force, MAX_MEDIAN_FORCE, "N", "mN")
    _check_compliance(_norms(marker - controller), force)


def _place(data: "Dataset", variable: Variable, index: NDArray[np.intp]) -> str:
    """Return where in a dataset a number stands, in words.

    Parameters
    ----------
    data : Dataset
        Where the number stands.
    variable : Variable
        The variable.
    index : ndarray of int, shape (dimension of the variable,)
        Position of the number along each dimension.
    """
    labels = {
        "pose": data.poses,
        "load_case": data.load_cases,
        "axis": AXES,
        "joint": data.joint_names,
    }
    label = {dim: labels[dim][i] for dim, i in zip(variable.dims, index, strict=True)}
    component = label.get("axis", label.get("joint"))
    where = f"{variable.name} {component} of pose {label['pose']}"
    return f"{where}, load case {label['load_case']!r}" if "load_case" in label else where


def _check_coverage(data: "Dataset", ok: BoolArray) -> None:
    if not ok.any():
        raise DatasetError(
            f"dataset has no usable reading: none of its {ok.size} readings has the status ok"
        )
    for case in np.flatnonzero(~ok.any(axis=0)):
        seen = sorted({STATUSES[value] for value in data.status[:, case]})
        raise DatasetError(
            f"load case {data.load_cases[case]!r} has no usable reading at any of"
            f" the {len(ok)} poses (status {', '.join(seen)}): leave it out or measure it"
        )


def _check_finite(data: "Dataset", variable: Variable, ok: BoolArray) -> None:
    values = data.arrays[variable.name]
    needed = ok if "load_case" in variable.dims else np.asarray(ok.any(axis=1))
    for index in np.argwhere(~np.isfinite(values) & needed[..., np.newaxis]):
        raise DatasetError(
            f"{_place(data, variable, index)} is {values[tuple(index)]} although the status is ok:"
            " give a finite number, or the status 'missing'"
        )


def _check_positive(data: "Dataset", variable: Variable, ok: BoolArray) -> None:
    values = data.arrays[variable.name]
    for index in np.argwhere(~(values > 0) & ok[..., np.newaxis]):
        raise DatasetError(
            f"{_place(data, variable, index)} is {values[tuple(index)]}:"
            " a standard deviation must be greater than 0"
        )


def _norms(vectors: FloatArray) -> FloatArray:
    norms: FloatArray = np.linalg.norm(vectors, axis=-1)
    return norms


def _check_joints(data: "Dataset") -> None:
    positions = data.joint_position
    prismatic = np.array(data.joint_units) == "m"
    limits = np.where(prismatic, MAX_TRAVEL, MAX_JOINT_ANGLE)
    beyond = ~(np.abs(positions) <= limits) & data.usable[..., np.newaxis]
    for index in np.argwhere(beyond):
        unit, mistake = ("m", "mm") if prismatic[index[-1]] else ("rad", "degrees")
        raise DatasetError(
            f"{_place(data, JOINT_POSITION, index)} is {positions[tuple(index)]:g} {unit}, beyond"
            f" ±{limits[index[-1]]:.4g} {unit}: looks like {mistake} in a column of {unit}"
        )


def _check_tcp(data: "Dataset") -> None:
    if data.tcp_position is not None:
        measured = data.usable.any(axis=1)
        distances = _norms(data.tcp_position[measured])
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
