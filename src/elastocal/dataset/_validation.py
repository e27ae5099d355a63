"""Checks of the numbers of a dataset; its names and shapes are already right here.

Two kinds: numbers that a reading cannot have, and numbers that look like the unit mistakes of the
shop floor, told apart from blunders. Degrees in a radian column or millimetres in
a metre column shift *every* number by a factor; a broken beam shifts one. Displacements and forces
are therefore judged by their median over the usable readings, which a single blunder cannot move;
the fit names the blunder.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from elastocal.dataset._layout import (
    JOINT_POSITION,
    JOINT_VARIABLES,
    LINK_JOINT_POSITION,
    MISSING,
    OK,
    REFERENCE_JOINT_POSITION,
    SEQUENCE,
    STATUSES,
    VARIABLES,
    Arrays,
    BoolArray,
    FloatArray,
    Labels,
    StatusArray,
    Variable,
)
from elastocal.errors import DatasetError

_MAX_JOINT_ANGLE = math.radians(2 * 350)
"""Largest plausible position of a revolute joint, in rad: twice the ±350° of a wrist's last
joint, the widest range in common use. Beyond it the column is in degrees."""

_MAX_APART = {"rad": math.radians(5.0), "m": 0.1}
"""Largest plausible median of what a joint has moved since the reference, or of what its link is
away from its motor: both are some millimetres at the tool, which is less than a degree."""

_MAX_TRAVEL = 100.0
"""Largest plausible position of a prismatic joint or of the TCP, in m: no rail is longer.
Beyond it the column is in mm."""

_MAX_MEDIAN_DISPLACEMENT = 0.1
"""Largest plausible median of a displacement under load, in m: arms deflect by millimetres."""

_MAX_MEDIAN_FORCE = 50e3
"""Largest plausible median of a force, in N: the strongest arms carry 2.3 t (23 kN)."""

_MIN_MEDIAN_COMPLIANCE = 1e-8
"""Smallest plausible deflection per force, in m/N: that of a stiff machine tool, 100 N/µm. An
arm has 2e-7 to 2e-5 m/N, so a deflection 1000 times too small falls below it."""

_MAX_MEDIAN_COMPLIANCE = 2e-4
"""Largest plausible deflection per force, in m/N: 5 N/mm, softer than any collaborative arm."""


def check_numbers(labels: Labels, arrays: Arrays) -> None:
    """Refuse a dataset with an ok reading that is not finite, or with nothing to read.

    Raises
    ------
    DatasetError
        Naming variable, component, pose, load case and value of the first offence.
    """
    ok = arrays["status"] == OK
    _check_coverage(labels, arrays["status"], ok)
    for variable in VARIABLES:
        if variable.name in arrays:
            values = arrays[variable.name]
            needed = ok if "load_case" in variable.dims else ok.any(axis=1)
            if variable == LINK_JOINT_POSITION:
                values = _without_absent_encoders(values)
            for place, value in _offences(labels, variable, values, ~np.isfinite(values), needed):
                raise DatasetError(
                    f"{place} is {value} although the status is ok: give a finite number, or the"
                    " status 'missing'"
                )
            if variable.name.endswith("_sigma"):
                for place, value in _offences(labels, variable, values, ~(values > 0), ok):
                    raise DatasetError(
                        f"{place} is {value}: a standard deviation must be greater than 0"
                    )
    if SEQUENCE.name in arrays:
        _check_sequence(labels, arrays[SEQUENCE.name], arrays["status"])


def check_plausible(labels: Labels, arrays: Arrays, joint_units: Sequence[str]) -> None:
    """Refuse a dataset whose numbers look like a unit mistake.

    Raises
    ------
    DatasetError
        Naming the quantity, its value, the limit and the mistake that it looks like.
    """
    ok = arrays["status"] == OK
    force = _norms(arrays["force"][ok])
    controller = arrays["controller_displacement"][ok]
    for variable in JOINT_VARIABLES:
        if variable.name in arrays:
            needed = ok if "load_case" in variable.dims else ok.any(axis=1)
            _check_joints(labels, variable, arrays[variable.name], joint_units, needed)
    for variable in (REFERENCE_JOINT_POSITION, LINK_JOINT_POSITION):
        if variable.name in arrays:
            _check_near(variable, arrays, joint_units, ok)
    if "tcp_position" in arrays:
        distances = _norms(arrays["tcp_position"][ok.any(axis=1)])
        _check_median("tcp_position", distances, _MAX_TRAVEL, "m", "mm")
    _check_median(
        "controller_displacement", _norms(controller), _MAX_MEDIAN_DISPLACEMENT, "m", "mm"
    )
    if "marker_displacement" in arrays:
        marker = arrays["marker_displacement"][ok]
        _check_median("marker_displacement", _norms(marker), _MAX_MEDIAN_DISPLACEMENT, "m", "mm")
    _check_median("force", force, _MAX_MEDIAN_FORCE, "N", "mN")
    if not force.any():
        raise DatasetError(f"force is zero in all {len(force)} usable readings: nothing to fit")
    if "reference_force" in arrays:
        _check_reference(labels, arrays["reference_force"], arrays["force"], ok)
    if "marker_displacement" in arrays:
        _check_compliance(_norms(marker - controller), force)


def _check_reference(
    labels: Labels, reference: FloatArray, force: FloatArray, ok: BoolArray
) -> None:
    """Refuse a reference loaded more than its pose: another unit, or raw wrenches with weight."""
    largest = np.where(ok, _norms(force), 0.0).max(axis=1)
    light = _norms(reference)
    for pose in np.flatnonzero((light > largest) & ok.any(axis=1))[:1].tolist():
        raise DatasetError(
            f"reference_force of pose {labels['pose'][pose]} is {light[pose]:.4g} N, more than its"
            f" largest load of {largest[pose]:.4g} N: it must be that of a light contact, tool"
            " weight removed"
        )


def _offences(
    labels: Labels, variable: Variable, values: np.ndarray, wrong: BoolArray, needed: BoolArray
) -> Iterator[tuple[str, object]]:
    """Yield place, in words, and value of each number that is wrong although it is needed."""
    for index in np.argwhere(wrong & needed[..., np.newaxis]):
        yield _place(labels, variable, index), values[tuple(index)]


def _place(labels: Labels, variable: Variable, index: NDArray[np.intp]) -> str:
    """Return where in a dataset a number stands, in words."""
    label = {dim: labels[dim][int(i)] for dim, i in zip(variable.dims, index, strict=True)}
    component = label.get("axis", label.get("joint"))
    where = f"{variable.name} {component} of pose {label['pose']}"
    return f"{where}, load case {label['load_case']!r}" if "load_case" in label else where


def _check_coverage(labels: Labels, status: StatusArray, ok: BoolArray) -> None:
    if not ok.any():
        raise DatasetError(
            f"dataset has no usable reading: none of its {ok.size} readings has the status ok"
        )
    for case in np.flatnonzero(~ok.any(axis=0)):
        seen = sorted({STATUSES[value] for value in status[:, case]})
        raise DatasetError(
            f"load case {labels['load_case'][int(case)]!r} has no usable reading at any of"
            f" the {len(ok)} poses (status {', '.join(seen)}): leave it out or measure it"
        )


def _norms(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(vectors, axis=-1))


def _without_absent_encoders(values: FloatArray) -> FloatArray:
    """Return link positions with zeros at the joints that have no secondary encoder."""
    absent = np.isnan(values).all(axis=(0, 1))
    if absent.all():
        raise DatasetError(
            f"{LINK_JOINT_POSITION.name} has no number: leave it out without secondary encoders"
        )
    return np.where(absent, 0.0, values)


def _check_sequence(labels: Labels, sequence: NDArray[np.int64], status: StatusArray) -> None:
    """Refuse two readings at one place in time; what was not measured has no place."""
    for pose, row in enumerate(sequence):
        first: dict[int, int] = {}
        for case in np.flatnonzero(status[pose] != MISSING).tolist():
            other = first.setdefault(int(row[case]), case)
            if other != case:
                raise DatasetError(
                    f"sequence of pose {labels['pose'][pose]} is {row[case]} for load cases"
                    f" {labels['load_case'][other]!r} and {labels['load_case'][case]!r}: each"
                    " reading of a pose needs its own place in time"
                )


def _check_near(
    variable: Variable, arrays: Arrays, joint_units: Sequence[str], ok: BoolArray
) -> None:
    """Refuse joints that are nowhere near those of the readings: the mark of a wrong unit."""
    values = arrays[variable.name]
    if "load_case" not in variable.dims:
        values = values[:, np.newaxis]
    apart = np.abs(values - arrays[JOINT_POSITION.name])[ok]
    known = ~np.isnan(apart).any(axis=0)
    for unit, mistake in (("rad", "degrees"), ("m", "mm")):
        columns = known & (np.array(joint_units) == unit)
        median = float(np.median(apart[:, columns].max(axis=1))) if columns.any() else 0.0
        if not median <= _MAX_APART[unit]:
            raise DatasetError(
                f"{variable.name} is a median of {median:g} {unit} away from joint_position over"
                f" {len(apart)} readings, more than {_MAX_APART[unit]:.3g} {unit}: looks like"
                f" {mistake} in a column of {unit}, or like those of other poses"
            )


def _check_joints(
    labels: Labels,
    variable: Variable,
    positions: FloatArray,
    joint_units: Sequence[str],
    needed: BoolArray,
) -> None:
    prismatic = np.array(joint_units) == "m"
    limits = np.where(prismatic, _MAX_TRAVEL, _MAX_JOINT_ANGLE)
    # A joint without a secondary encoder has NaN throughout, which is not beyond.
    beyond = (np.abs(positions) > limits) & needed[..., np.newaxis]
    for index in np.argwhere(beyond):
        unit, mistake = ("m", "mm") if prismatic[index[-1]] else ("rad", "degrees")
        raise DatasetError(
            f"{_place(labels, variable, index)} is {positions[tuple(index)]:g} {unit}, beyond"
            f" ±{limits[index[-1]]:.4g} {unit}: looks like {mistake} in a column of {unit}"
        )


def _check_median(name: str, norms: FloatArray, limit: float, unit: str, mistake: str) -> None:
    median = float(np.median(norms))
    if not median <= limit:
        raise DatasetError(
            f"{name} has a median norm of {median:g} {unit} over {len(norms)} readings, more than"
            f" {limit:g} {unit}: looks like {mistake} in a column of {unit}"
        )


def _check_compliance(deflection: FloatArray, force: FloatArray) -> None:
    if not deflection.any():
        raise DatasetError(
            f"marker_displacement equals controller_displacement in all {len(force)} usable"
            " readings: the deflection is zero, as if one had been copied from the other"
        )
    # Unloaded readings say nothing about the ratio.
    loaded = force > 0
    compliance = float(np.median(deflection[loaded]) / np.median(force[loaded]))
    if _MIN_MEDIAN_COMPLIANCE <= compliance <= _MAX_MEDIAN_COMPLIANCE:
        return
    if compliance > _MAX_MEDIAN_COMPLIANCE:
        mistake = "softer than any robot: looks like kN in a column of N, or mm in a column of m"
    else:
        mistake = "stiffer than any robot: looks like m in a column of mm, or N in a column of kN"
    raise DatasetError(
        f"median deflection per median force is {compliance:g} m/N over {int(loaded.sum())} loaded"
        f" readings, outside {_MIN_MEDIAN_COMPLIANCE:g} to {_MAX_MEDIAN_COMPLIANCE:g} m/N:"
        f" {mistake}"
    )
