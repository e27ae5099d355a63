"""The dataset: the labelled arrays of the paper's Procedure 1.

The checks of its numbers assume that names and shapes are right.

Two kinds: numbers that a reading cannot have, and numbers that look like the unit mistakes of the
shop floor, as distinct from blunders. Degrees in a radian column or millimetres in a metre column
shift *every* number by a factor; a broken beam shifts one. Displacements and forces are therefore
judged by their median over the usable readings, which a single blunder cannot move; the fit names
the blunder.
"""

from __future__ import annotations  # signatures show ArrayLike by its name

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elastocal.dataset._labelled import (
    campaign_labels,
    labelled_from_xarray,
    pose_labels,
    read_contacts,
    read_joint_units,
    read_sequence,
    read_status,
    read_variables,
    text_labels,
    xarray_from_labelled,
)
from elastocal.dataset._layout import (
    AXES,
    CONDITIONED,
    CONTACTS,
    ENCODER_VARIABLES,
    INTEGERS,
    JOINT_POSITION,
    JOINT_VARIABLES,
    MARKER_POSITION,
    MISSING,
    OK,
    REFERENCE_JOINT_POSITION,
    REFERENCE_LINK_JOINT_POSITION,
    SCHEMA,
    SCHEMA_2,
    SEQUENCE,
    STATIONS,
    STATUSES,
    VARIABLES,
    Arrays,
    BoolArray,
    FloatArray,
    IntArray,
    Labels,
    StatusArray,
    Variable,
    Vector,
    canonical_attributes,
    freeze,
    read_doubts,
    read_stations,
    read_vector,
    write_stations,
    write_vector,
)
from elastocal.dataset._structure import (
    assemble,
    check_names,
    check_structure,
    needed_schema,
    unmeasured_poses,
)
from elastocal.dataset.merging import selected, usable_readings
from elastocal.dataset.readings import Readings
from elastocal.errors import DatasetError
from elastocal.records import LabelledArrays
from elastocal.results import Result

if TYPE_CHECKING:
    import xarray as xr

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
    if "marker_displacement" in arrays and unmeasured_poses(arrays)[ok.any(axis=1)].all():
        raise DatasetError(
            "marker_displacement has no number: leave it out where no tracker measured"
        )
    for variable in VARIABLES:
        if variable.name in arrays:
            values = arrays[variable.name]
            needed = ok if "load_case" in variable.dims else ok.any(axis=1)
            if variable in ENCODER_VARIABLES:
                values = _without_absent_encoders(variable, values)
            if variable.name in _OF_METROLOGY:
                seen = ~unmeasured_poses(arrays)
                needed = needed & (seen[:, np.newaxis] if needed.ndim > 1 else seen)
            for place, value in _offences(labels, variable, values, ~np.isfinite(values), needed):
                raise DatasetError(
                    f"{place} is {value} although the status is ok: give a finite number, or the"
                    " status 'missing'"
                )
            if variable.name.endswith("_sigma"):
                for place, value in _offences(labels, variable, values, ~(values > 0), needed):
                    raise DatasetError(
                        f"{place} is {value}: a standard deviation must be greater than 0"
                    )
    _check_encoders(labels, arrays)
    if SEQUENCE.name in arrays:
        _check_sequence(labels, arrays[SEQUENCE.name], arrays["status"])


_OF_METROLOGY = ("marker_displacement", "marker_sigma", "marker_position")
"""Variables that have no number at a pose that no tracker measured."""


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
    for variable in (REFERENCE_JOINT_POSITION, *ENCODER_VARIABLES):
        if variable.name in arrays:
            _check_near(variable, arrays, joint_units, ok)
    if "tcp_position" in arrays:
        distances = _norms(arrays["tcp_position"][ok.any(axis=1)])
        _check_median("tcp_position", distances, _MAX_TRAVEL, "m", "mm")
    _check_median(
        "controller_displacement", _norms(controller), _MAX_MEDIAN_DISPLACEMENT, "m", "mm"
    )
    if "marker_displacement" in arrays:
        seen = ok & np.isfinite(arrays["marker_displacement"]).all(axis=2)
        marker = arrays["marker_displacement"][seen]
        _check_median("marker_displacement", _norms(marker), _MAX_MEDIAN_DISPLACEMENT, "m", "mm")
    _check_median("force", force, _MAX_MEDIAN_FORCE, "N", "mN")
    if not force.any():
        raise DatasetError(f"force is zero in all {len(force)} usable readings: nothing to fit")
    if "reference_force" in arrays:
        _check_reference(labels, arrays["reference_force"], arrays["force"], ok)
    if "marker_displacement" in arrays:
        away = marker - arrays["controller_displacement"][seen]
        _check_compliance(_norms(away), _norms(arrays["force"][seen]))


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
    """Return the position of a number in a dataset, in words."""
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


def _without_absent_encoders(variable: Variable, values: FloatArray) -> FloatArray:
    """Return link positions with zeros at the joints that have no secondary encoder."""
    absent = _absent_encoders(values)
    if absent.all():
        raise DatasetError(
            f"{variable.name} has no number: leave it out without secondary encoders"
        )
    return np.where(absent, 0.0, values)


def _absent_encoders(values: FloatArray) -> BoolArray:
    """Return which joints have no secondary encoder, shape (joint,)."""
    return np.asarray(np.isnan(values).all(axis=tuple(range(values.ndim - 1))))


def _check_encoders(labels: Labels, arrays: Arrays) -> None:
    """Refuse links at the reference without those under load, or of other joints."""
    link, reference = (each.name for each in ENCODER_VARIABLES)
    if reference not in arrays:
        return
    if link not in arrays:
        raise DatasetError(f"{reference} needs {link}: there are no links under load")
    differ = _absent_encoders(arrays[link]) != _absent_encoders(arrays[reference])
    for joint in np.flatnonzero(differ)[:1].tolist():
        raise DatasetError(
            f"{reference} and {link} have different encoders: only one of them has numbers at"
            f" joint {labels['joint'][joint]!r}"
        )


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


@dataclass(frozen=True, eq=False, repr=False)
class Dataset(Result):
    """Measured displacements, forces and joint positions, by pose and load case.

    All in SI units, in the order of their labels; arrays are copied in and read-only. Plain arrays
    become a dataset with `from_arrays`, labelled ones in any unit and order with `from_labelled`
    and `from_xarray`.

    Raises
    ------
    DatasetError
        If the data break the contract of docs/reference/files/dataset.md; the message names the
        place.
    SchemaError
        If the schema is not known.
    """

    poses: tuple[int, ...]
    """Labels of the poses, in order."""
    load_cases: tuple[str, ...]
    """Names of the load cases, in order."""
    joint_names: tuple[str, ...]
    """Names of the joints, in the order of the file."""
    joint_units: tuple[str, ...]
    """Unit of each joint position: ``"rad"`` for a revolute joint, ``"m"`` for a prismatic."""
    joint_position: FloatArray
    """Joint positions after settling (paper: Theta^c), shape (pose, load_case, joint)."""
    force: FloatArray
    """Force on the robot at the TCP in base (F^m), shape (pose, load_case, 3), in N."""
    controller_displacement: FloatArray
    """Displacement by the controller (P^c), in base, shape (pose, load_case, 3), in m."""
    status: StatusArray
    """Index into ``STATUSES`` of each reading, shape (pose, load_case)."""
    marker_displacement: FloatArray | None = None
    """Displacement by the tracker (P^m), in base, shape (pose, load_case, 3), in m; NaN at poses
    that none measured, None where none measured any."""
    moment: FloatArray | None = None
    """Moment on the robot at the TCP in base, shape (pose, load_case, 3), in N·m."""
    force_sigma: FloatArray | None = None
    """Standard deviation of the force, shape (pose, load_case, 3), in N."""
    marker_sigma: FloatArray | None = None
    """Standard deviation of the marker displacement, shape (pose, load_case, 3), in m."""
    tcp_position: FloatArray | None = None
    """Unloaded TCP position in base, shape (pose, 3), in m."""
    marker_position: FloatArray | None = None
    """Marker position by the tracker when the zero of both displacements was read, in base, shape
    (pose, 3), in m: the stations can be registered anew by it (`stations`)."""
    sequence: IntArray | None = None
    """Place of each reading in time among those of its pose, shape (pose, load_case); None: the
    order of the load cases."""
    contacts: StatusArray | None = None
    """Disks or tips stacked between tool and tooling at each press, shape (pose, load_case); None:
    one at all."""
    reference_joint_position: FloatArray | None = None
    """Joint positions when the zero of both displacements was read, shape (pose, joint)."""
    reference_force: FloatArray | None = None
    """Force on the robot at the TCP in base then, shape (pose, 3), in N; None: none."""
    link_joint_position: FloatArray | None = None
    """Positions of the links by secondary encoders, shape (pose, load_case, joint)."""
    reference_link_joint_position: FloatArray | None = None
    """The same when the zero of both displacements was read, shape (pose, joint); None: each pose
    has a zero of its own that is not known."""
    campaigns: tuple[str, ...] = ()
    """Campaign of each pose; empty where there are none."""
    attributes: Mapping[str, str] = field(default_factory=lambda: {"schema": SCHEMA})
    """Attributes of the file. The schema becomes the first one that has all that is here."""

    def __post_init__(self) -> None:
        for name in ("poses", "load_cases", "joint_names", "joint_units", "campaigns"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        for variable in (*VARIABLES, *INTEGERS):
            values = getattr(self, variable.name)
            if values is not None:
                values = np.array(values, INTEGERS.get(variable, np.float64))
                freeze(values)
                object.__setattr__(self, variable.name, values)
        attributes = canonical_attributes(self.attributes)
        check_structure(self._labels, self._variables, self.joint_units)
        schema = needed_schema(self._labels, self._variables, attributes)
        object.__setattr__(self, "attributes", attributes | {"schema": schema})
        check_numbers(self._labels, self._variables)

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the size and origin of the measurements."""
        usable, poses = self.usable, len(self.poses)
        return (
            ("robot", self.robot_name or "without a name"),
            ("readings", f"{int(usable.sum())} usable of {usable.size}, at {poses} poses"),
            ("load cases", ", ".join(self.load_cases)),
            ("provenance", self.provenance or "not known"),
        )

    @classmethod
    def from_arrays(  # noqa: PLR0913 (one keyword for each variable of the file)
        cls,
        *,
        joint_position: ArrayLike,
        force: ArrayLike,
        controller_displacement: ArrayLike,
        marker_displacement: ArrayLike | None = None,
        joint_names: Sequence[str],
        load_cases: Sequence[str],
        poses: Sequence[int] | None = None,
        moment: ArrayLike | None = None,
        status: ArrayLike | None = None,
        force_sigma: ArrayLike | None = None,
        marker_sigma: ArrayLike | None = None,
        tcp_position: ArrayLike | None = None,
        marker_position: ArrayLike | None = None,
        sequence: ArrayLike | None = None,
        contacts: ArrayLike | None = None,
        reference_joint_position: ArrayLike | None = None,
        reference_force: ArrayLike | None = None,
        link_joint_position: ArrayLike | None = None,
        reference_link_joint_position: ArrayLike | None = None,
        campaigns: Sequence[str] | None = None,
        joint_units: Sequence[str] | None = None,
        robot_name: str = "",
        robot_urdf: str | None = None,
        tcp_frame: str | None = None,
        marker: Vector | None = None,
        gravity: Vector | None = None,
        conditioned: bool = False,
        check: Sequence[str] = (),
        stations: Mapping[str, Sequence[int]] | None = None,
        provenance: str = "",
    ) -> Dataset:
        """Return the dataset of plain arrays in SI units, if it is plausible.

        Parameters
        ----------
        joint_position, force, controller_displacement, marker_displacement : array_like
            As the fields of these names. Displacements are those of the TCP, or both of the marker
            where ``marker`` is given; the tracker's is left out where there was no metrology.
        moment, tcp_position, marker_position, sequence, contacts : array_like, optional
            As the fields of these names.
        reference_joint_position, reference_force : array_like, optional
            When the zero of both displacements was read, as the fields of these names.
        link_joint_position, reference_link_joint_position : array_like, optional
            By secondary encoders, as the fields of these names.
        joint_names, load_cases : sequence of str
            Labels of the joints and the load cases.
        poses : sequence of int, optional
            Labels of the poses; 0, 1, 2 … by default.
        status : array_like of int, shape (pose, load_case), optional
            Index into ``STATUSES`` of each reading; 0 (ok) by default.
        force_sigma, marker_sigma : array_like, shape () or (pose, load_case[, 3]), optional
            Standard deviations in N and m.
        campaigns : sequence of str, optional
            Campaign of each pose.
        joint_units : sequence of str, optional
            ``"rad"`` or ``"m"`` for each joint; ``"rad"`` by default.
        robot_name, robot_urdf, tcp_frame, provenance : str, optional
            Attributes of the file: the robot, its URDF text, a link of it, and where from.
        marker : tuple of float, optional
            Metrology marker in the frame ``tcp_frame``, in m.
        gravity : tuple of float, optional
            Acceleration of gravity in base, in m/s²; that of an upright base by default.
        conditioned : bool
            Whether each pose began with a full press, made before the reference was read.
        check : sequence of str
            Load cases that are kept out of every fit.
        stations : mapping, optional
            Poses that each station of the tracker measured, by its name.

        Raises
        ------
        DatasetError
            If shapes, labels or values break the contract, or look like a unit mistake.
        """
        arrays = {
            "joint_position": joint_position,
            "force": force,
            "moment": moment,
            "controller_displacement": controller_displacement,
            "marker_displacement": marker_displacement,
            "status": status,
            "force_sigma": force_sigma,
            "marker_sigma": marker_sigma,
            "tcp_position": tcp_position,
            MARKER_POSITION.name: marker_position,
            "sequence": sequence,
            CONTACTS.name: contacts,
            "reference_joint_position": reference_joint_position,
            "reference_force": reference_force,
            "link_joint_position": link_joint_position,
            REFERENCE_LINK_JOINT_POSITION.name: reference_link_joint_position,
        }
        attributes = {
            "schema": SCHEMA_2,
            "robot_name": robot_name,
            "robot_urdf": robot_urdf,
            "tcp_frame": tcp_frame,
            "marker": None if marker is None else write_vector(marker),
            "gravity": None if gravity is None else write_vector(gravity, "m/s2"),
            "check": ", ".join(check) or None,
            "history": CONDITIONED if conditioned else None,
            STATIONS: None if stations is None else write_stations(stations),
            "provenance": provenance,
        }
        labels = {"pose": poses, "load_case": load_cases, "joint": joint_names}
        labels["campaign"] = campaigns
        units = joint_units or ("rad",) * len(joint_names)
        dataset = cls.from_labelled(assemble(labels, arrays, units, attributes))
        dataset.require_plausible()
        return dataset

    @classmethod
    def from_labelled(cls, arrays: LabelledArrays) -> Dataset:
        """Return the dataset of labelled arrays, such as a NetCDF file holds them.

        Dimensions and axes may be in any order; units that are not SI are converted.

        Raises
        ------
        DatasetError
            If a variable, coordinate, attribute or unit is missing, unknown or of the wrong form.
        SchemaError
            If the schema is not known.
        """
        attributes = canonical_attributes(arrays.attributes)
        check_names(arrays)
        joint_names = text_labels(arrays, "joint")
        joint_units, factors = read_joint_units(arrays, len(joint_names))
        status = read_status(arrays)
        dataset = cls(
            poses=pose_labels(arrays),
            load_cases=tuple(text_labels(arrays, "load_case")),
            joint_names=tuple(joint_names),
            joint_units=tuple(joint_units),
            **read_variables(arrays, factors),
            status=status,
            sequence=read_sequence(arrays, status),
            contacts=read_contacts(arrays, status),
            campaigns=tuple(campaign_labels(arrays)),
            attributes=attributes,
        )
        if attributes["schema"] == SCHEMA and dataset.poses_unmeasured:
            raise DatasetError(
                f"marker_displacement of pose {dataset.poses_unmeasured[0]} has no number although"
                " its status is ok: give finite numbers, the status 'missing', or, where no tracker"
                f" measured, the schema {SCHEMA_2!r}"
            )
        return dataset

    @classmethod
    def from_xarray(cls, data: xr.Dataset) -> Dataset:
        """Return the dataset of an `xarray.Dataset`, as plausible as one of a file.

        Raises
        ------
        DatasetError, SchemaError
            As `from_labelled` and `require_plausible`.
        """
        dataset = cls.from_labelled(labelled_from_xarray(data))
        dataset.require_plausible()
        return dataset

    def to_labelled(self) -> LabelledArrays:
        """Return the arrays with their labels, units and meanings, as the NetCDF file has them."""
        labels = {
            "pose": np.array(self.poses, dtype=np.int64),
            "load_case": np.array(self.load_cases, dtype=np.str_),
            "joint": np.array(self.joint_names, dtype=np.str_),
            "campaign": np.array(self.campaigns, dtype=np.str_) if self.campaigns else None,
        }
        arrays = assemble(labels, self._variables, self.joint_units, self.attributes)
        for each in arrays.variables.values():
            freeze(each.values)
        return arrays

    def to_xarray(self) -> xr.Dataset:
        """Return the dataset as an `xarray.Dataset`, which shares the read-only arrays."""
        return xarray_from_labelled(self.to_labelled())

    def require_plausible(self) -> None:
        """Refuse numbers that look like a unit mistake.

        Raises
        ------
        DatasetError
            Naming the quantity, its value, the limit and the mistake that it looks like.
        """
        check_plausible(self._labels, self._variables, self.joint_units)

    @property
    def arrays(self) -> dict[str, FloatArray]:
        """The quantities that are present, by name: all variables but those of whole numbers."""
        return {each.name: v for each in VARIABLES if (v := getattr(self, each.name)) is not None}

    @property
    def stations(self) -> dict[str, tuple[int, ...]]:
        """The poses that each station of the tracker measured, by its name; none: not known."""
        return read_stations(self.attributes)

    @property
    def doubts(self) -> tuple[str, ...]:
        """The mistakes that `import` suspected in the readings, as sentences."""
        return read_doubts(self.attributes)

    @property
    def _variables(self) -> dict[str, np.ndarray]:
        found = {each.name: getattr(self, each.name) for each in (*VARIABLES, *INTEGERS)}
        return {name: values for name, values in found.items() if values is not None}

    @property
    def _labels(self) -> Labels:
        own = {"pose": self.poses, "load_case": self.load_cases, "joint": self.joint_names}
        return own | {"axis": AXES, "campaign": self.campaigns}

    @property
    def usable(self) -> BoolArray:
        """Whether each reading has the status ok, shape (pose, load_case)."""
        return np.asarray(self.status == OK)

    @property
    def poses_unmeasured(self) -> tuple[int, ...]:
        """Labels of the poses with usable readings that no tracker measured."""
        unmeasured = unmeasured_poses(self._variables)
        return tuple(pose for pose, none in zip(self.poses, unmeasured, strict=True) if none)

    @property
    def robot_name(self) -> str:
        """Name of the robot; empty when not known."""
        return self.attributes["robot_name"]

    @property
    def robot_urdf(self) -> str | None:
        """URDF text of the robot; None when the file does not carry one."""
        return self.attributes.get("robot_urdf")

    @property
    def tcp_frame(self) -> str | None:
        """Link of the URDF at the tool centre point; None when the file does not name one."""
        return self.attributes.get("tcp_frame")

    @property
    def marker(self) -> Vector | None:
        """Metrology marker in the tcp frame, in m; None: at the tcp, or the file does not say."""
        return read_vector("marker", self.attributes)

    @property
    def gravity(self) -> Vector | None:
        """Acceleration of gravity in base, in m/s²; None: the base stands upright."""
        return read_vector("gravity", self.attributes)

    @property
    def conditioned(self) -> bool:
        """Whether each pose's first reading is a full press made before the reference was read."""
        return self.attributes.get("history") == CONDITIONED

    @property
    def check_cases(self) -> tuple[str, ...]:
        """Load cases that are kept out of every fit, to check it; those that are not here too."""
        return tuple(filter(None, map(str.strip, self.attributes.get("check", "").split(","))))

    @property
    def order(self) -> IntArray:
        """Place of each reading in time among those of its pose, shape (pose, load_case)."""
        default = np.tile(np.arange(len(self.load_cases)), (len(self.poses), 1))
        return default if self.sequence is None else self.sequence

    @property
    def provenance(self) -> str:
        """Origin of the data; empty when not known."""
        return self.attributes["provenance"]

    def select(
        self, poses: Sequence[int] | None = None, load_cases: Sequence[str] | None = None
    ) -> Dataset:
        """Return some poses and load cases, in the order asked for.

        Load cases that are not asked for by name and have no usable reading at the chosen poses
        are left out. Load cases asked for in another order get a ``sequence``: time stays.

        Parameters
        ----------
        poses : sequence of int, optional
            Labels of poses; all by default.
        load_cases : sequence of str, optional
            Names of load cases; all by default.

        Raises
        ------
        DatasetError
            If a label is unknown or repeated, or nothing usable is left.
        """
        return selected(self, poses, load_cases)

    def readings(self, joint_names: Sequence[str], *, check: bool = False) -> Readings:
        """Return the usable readings as flat arrays, the joints in the robot's order.

        Parameters
        ----------
        joint_names : sequence of str
            Joints of the robot; the columns are brought into this order *by name*.
        check : bool
            Those that are kept out of every fit, in place of the others; friction felt both.

        Raises
        ------
        DatasetError
            If the dataset's joints are not these.
        """
        return usable_readings(self, joint_names, check=check)
