"""The dataset: the labelled arrays of the paper's Procedure 1."""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from elastocal.dataset._layout import (
    AXES,
    OK,
    SCHEMA,
    VARIABLE_NAMES,
    BoolArray,
    FloatArray,
    Labels,
    Point,
    StatusArray,
    canonical_attributes,
    freeze,
    read_point,
    write_point,
)
from elastocal.dataset._structure import (
    assemble,
    check_names,
    check_structure,
    pose_labels,
    read_joint_units,
    read_status,
    read_variables,
    text_labels,
)
from elastocal.dataset._validation import check_numbers, check_plausible
from elastocal.dataset.readings import Readings
from elastocal.errors import DatasetError, nearest
from elastocal.records import LabelledArray, LabelledArrays

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False, repr=False)
class Dataset:
    """Measured displacements, forces and joint positions, by pose and load case.

    All in SI units, in the order of their labels; arrays are copied in and read-only. Plain arrays
    become a dataset with `from_arrays`, labelled ones in any unit and order with `from_labelled`
    and `from_xarray`.

    Raises
    ------
    DatasetError
        If the data break the contract of spec section 3; the message names the place.
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
    marker_displacement: FloatArray
    """Displacement by the tracker (P^m), in base, shape (pose, load_case, 3), in m."""
    status: StatusArray
    """Index into ``STATUSES`` of each reading, shape (pose, load_case)."""
    moment: FloatArray | None = None
    """Moment on the robot at the TCP in base, shape (pose, load_case, 3), in N·m."""
    force_sigma: FloatArray | None = None
    """Standard deviation of the force, shape (pose, load_case, 3), in N."""
    marker_sigma: FloatArray | None = None
    """Standard deviation of the marker displacement, shape (pose, load_case, 3), in m."""
    tcp_position: FloatArray | None = None
    """Unloaded TCP position in base, shape (pose, 3), in m."""
    attributes: Mapping[str, str] = field(default_factory=lambda: {"schema": SCHEMA})
    """Attributes of the file: schema, robot, marker, provenance, and CF's remarks."""

    def __post_init__(self) -> None:
        for name in ("poses", "load_cases", "joint_names", "joint_units"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        for name in VARIABLE_NAMES:
            if getattr(self, name) is not None:
                values = np.array(getattr(self, name), np.int8 if name == "status" else np.float64)
                freeze(values)
                object.__setattr__(self, name, values)
        object.__setattr__(self, "attributes", canonical_attributes(self.attributes))
        check_structure(self._labels, self._variables, self.joint_units)
        check_numbers(self._labels, self._variables)

    def __repr__(self) -> str:
        """Return the size of the dataset and where it comes from, in one line."""
        return (
            f"Dataset({self.robot_name or 'robot without name'}: {int(self.usable.sum())} usable"
            f" readings at {len(self.poses)} poses, load cases {', '.join(self.load_cases)})"
        )

    @classmethod
    def from_arrays(  # noqa: PLR0913 (one keyword for each variable of the file)
        cls,
        *,
        joint_position: ArrayLike,
        force: ArrayLike,
        controller_displacement: ArrayLike,
        marker_displacement: ArrayLike,
        joint_names: Sequence[str],
        load_cases: Sequence[str],
        poses: Sequence[int] | None = None,
        moment: ArrayLike | None = None,
        status: ArrayLike | None = None,
        force_sigma: ArrayLike | None = None,
        marker_sigma: ArrayLike | None = None,
        tcp_position: ArrayLike | None = None,
        joint_units: Sequence[str] | None = None,
        robot_name: str = "",
        robot_urdf: str | None = None,
        tcp_frame: str | None = None,
        marker: Point | None = None,
        provenance: str = "",
    ) -> "Dataset":
        """Return the dataset of plain arrays in SI units, if it is plausible.

        Parameters
        ----------
        joint_position : array_like, shape (pose, load_case, joint)
            Joint positions after settling (paper: Theta^c), in rad, or m for prismatic joints.
        force : array_like, shape (pose, load_case, 3)
            Force on the robot at the TCP in base (F^m), in N.
        controller_displacement, marker_displacement : array_like, shape (pose, load_case, 3)
            Displacements under load by controller (P^c) and tracker (P^m), in base, in m: of the
            TCP, or both of the marker where ``marker`` is given.
        joint_names, load_cases : sequence of str
            Labels of the joints and the load cases.
        poses : sequence of int, optional
            Labels of the poses; 0, 1, 2 … by default.
        moment : array_like, shape (pose, load_case, 3), optional
            Moment on the robot at the TCP in base, in N·m.
        status : array_like of int, shape (pose, load_case), optional
            Index into ``STATUSES`` of each reading; 0 (ok) by default.
        force_sigma, marker_sigma : array_like, shape () or (pose, load_case[, 3]), optional
            Standard deviations in N and m.
        tcp_position : array_like, shape (pose, 3), optional
            Unloaded TCP position in base, in m.
        joint_units : sequence of str, optional
            ``"rad"`` or ``"m"`` for each joint; ``"rad"`` by default.
        robot_name, robot_urdf, tcp_frame, provenance : str, optional
            Attributes of the file: the robot, its URDF text, a link of it, and where from.
        marker : tuple of float, optional
            Metrology marker in the frame ``tcp_frame``, in m.

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
        }
        attributes = {
            "schema": SCHEMA,
            "robot_name": robot_name,
            "robot_urdf": robot_urdf,
            "tcp_frame": tcp_frame,
            "marker": None if marker is None else write_point(marker),
            "provenance": provenance,
        }
        labels = {"pose": poses, "load_case": load_cases, "joint": joint_names}
        units = joint_units or ("rad",) * len(joint_names)
        dataset = cls.from_labelled(assemble(labels, arrays, units, attributes))
        dataset.require_plausible()
        return dataset

    @classmethod
    def from_labelled(cls, arrays: LabelledArrays) -> "Dataset":
        """Return the dataset of labelled arrays, such as a NetCDF file holds them.

        Dimensions and axes may stand in any order. A stated unit that is not SI is converted,
        since nothing is guessed; a missing one is refused.

        Raises
        ------
        DatasetError
            If a variable, coordinate, attribute or unit is missing, unknown or of the wrong form.
        SchemaError
            If the schema is not known.
        """
        attributes = canonical_attributes(arrays.attributes)
        check_names(arrays)
        poses, load_cases = pose_labels(arrays), text_labels(arrays, "load_case")
        joint_names = text_labels(arrays, "joint")
        joint_units, factors = read_joint_units(arrays, len(joint_names))
        return cls(
            poses=poses,
            load_cases=tuple(load_cases),
            joint_names=tuple(joint_names),
            joint_units=tuple(joint_units),
            **read_variables(arrays, factors),
            status=read_status(arrays),
            attributes=attributes,
        )

    @classmethod
    def from_xarray(cls, data: "xr.Dataset") -> "Dataset":
        """Return the dataset of an `xarray.Dataset`; see `from_labelled`."""
        coordinates = [str(name) for name in data.coords if data[name].dims != (name,)]
        variables = {
            str(name): LabelledArray(tuple(map(str, each.dims)), each.values, each.attrs)
            for name, each in data.variables.items()
        }
        attributes = {str(name): value for name, value in data.attrs.items()}
        return cls.from_labelled(LabelledArrays(variables, attributes, tuple(coordinates)))

    def to_labelled(self) -> LabelledArrays:
        """Return the arrays with their labels, units and meanings, as the NetCDF file has them."""
        labels = {
            "pose": np.array(self.poses, dtype=np.int64),
            "load_case": np.array(self.load_cases, dtype=np.str_),
            "joint": np.array(self.joint_names, dtype=np.str_),
        }
        arrays = assemble(labels, self._variables, self.joint_units, self.attributes)
        for each in arrays.variables.values():
            freeze(each.values)
        return arrays

    def to_xarray(self) -> "xr.Dataset":
        """Return the dataset as an `xarray.Dataset`, which shares the read-only arrays."""
        import xarray as xr

        arrays = self.to_labelled()
        variables = {
            name: xr.Variable(each.dims, each.values, each.attributes)
            for name, each in arrays.variables.items()
        }
        coordinates = {name: variables.pop(name) for name in arrays.coordinates}
        return xr.Dataset(variables, coordinates, arrays.attributes)

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
        """The variables that are present, by name; all but the status."""
        return {name: each for name, each in self._variables.items() if name != "status"}

    @property
    def _variables(self) -> dict[str, np.ndarray]:
        found = {name: getattr(self, name) for name in VARIABLE_NAMES}
        return {name: values for name, values in found.items() if values is not None}

    @property
    def _labels(self) -> Labels:
        return {
            "pose": self.poses,
            "load_case": self.load_cases,
            "axis": AXES,
            "joint": self.joint_names,
        }

    @property
    def usable(self) -> BoolArray:
        """Whether each reading has the status ok, shape (pose, load_case)."""
        mask: BoolArray = self.status == OK
        return mask

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
    def marker(self) -> Point | None:
        """Metrology marker in the tcp frame, in m; None: at the tcp, or the file does not say."""
        text = self.attributes.get("marker")
        return None if text is None else read_point("marker", text)

    @property
    def provenance(self) -> str:
        """Where the data come from; empty when not known."""
        return self.attributes["provenance"]

    def select(
        self, poses: Sequence[int] | None = None, load_cases: Sequence[str] | None = None
    ) -> "Dataset":
        """Return some poses and load cases, in the order asked for.

        Load cases that are not asked for by name and have no usable reading at the chosen poses
        are left out.

        Parameters
        ----------
        poses : sequence of int, optional
            Labels of poses; all by default.
        load_cases : sequence of str, optional
            Names of load cases; all by default.

        Raises
        ------
        DatasetError
            If a label is unknown or stands twice, or nothing usable is left.
        """
        rows = list(range(len(self.poses)))
        if poses is not None:
            rows = _positions("pose", poses, self.poses)
        columns = list(range(len(self.load_cases)))
        if load_cases is not None:
            columns = _positions("load case", load_cases, self.load_cases)
        elif self.usable[rows].any():
            columns = np.flatnonzero(self.usable[rows].any(axis=0)).tolist()
        return self._taken(rows, columns)

    def readings(self, joint_names: Sequence[str]) -> Readings:
        """Return the usable readings as flat arrays, the joints in the robot's order.

        Parameters
        ----------
        joint_names : sequence of str
            Joints of the robot; the columns are brought into this order *by name*.

        Raises
        ------
        DatasetError
            If the dataset's joints are not these.
        """
        wanted = list(joint_names)
        if sorted(wanted) != sorted(self.joint_names):
            raise DatasetError(
                f"joints of the dataset are {list(self.joint_names)}, those of the robot {wanted}:"
                " they must have the same names"
            )
        order = [self.joint_names.index(name) for name in wanted]
        pose, case = np.nonzero(self.usable)
        flat = {
            name: values[pose] if name == "tcp_position" else values[pose, case]
            for name, values in self.arrays.items()
        }
        flat["joint_position"] = flat["joint_position"][:, order]
        return Readings(np.array(self.poses)[pose], np.array(self.load_cases)[case], **flat)

    def _taken(self, rows: Sequence[int], columns: Sequence[int]) -> "Dataset":
        """Return the poses and load cases at some positions."""
        index = np.ix_(rows, columns)
        return Dataset(
            poses=tuple(self.poses[row] for row in rows),
            load_cases=tuple(self.load_cases[column] for column in columns),
            joint_names=self.joint_names,
            joint_units=self.joint_units,
            attributes=self.attributes,
            **{
                name: values[list(rows)] if name == "tcp_position" else values[index]
                for name, values in self._variables.items()
            },
        )


def _positions(kind: str, labels: Sequence[object], known: Sequence[Hashable]) -> list[int]:
    for label in labels:
        if label not in known:
            listed = ", ".join(map(str, known[:20])) + (", …" if len(known) > 20 else "")
            names = [name for name in known if isinstance(name, str)]
            hint = nearest(label, names) if isinstance(label, str) else ""
            raise DatasetError(f"{kind} {label!r} is not in the dataset{hint} (known: {listed})")
    return [known.index(label) for label in labels]
