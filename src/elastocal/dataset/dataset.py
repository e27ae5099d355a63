"""The dataset: the labelled arrays of the paper's Procedure 1."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from elastocal.dataset.assembly import as_array, assemble
from elastocal.dataset.attributes import read_point, write_point
from elastocal.dataset.layout import SCHEMA, SI_JOINT_UNITS, FloatArray, freeze
from elastocal.dataset.plausibility import check_plausible
from elastocal.dataset.readings import Readings
from elastocal.dataset.structure import canonical
from elastocal.dataset.validation import check_numbers, usable
from elastocal.errors import DatasetError, nearest


@dataclass(frozen=True, eq=False)
class Dataset:
    """Measured displacements, forces and joint positions, by pose and load case.

    Whatever is given is copied, brought into canonical form (SI units, float64, dimensions in
    order, ``status`` present) and checked; the arrays are read-only.

    Raises
    ------
    DatasetError
        If the data break the contract of spec section 3; the message names the place.
    SchemaError
        If the schema is not known.
    """

    data: xr.Dataset
    """Variables, coordinates, units and attributes as spec section 3 lists them."""

    def __post_init__(self) -> None:
        data = canonical(self.data)
        check_numbers(data)
        for variable in data.variables.values():
            freeze(variable.values)
        object.__setattr__(self, "data", data)

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
        marker: tuple[float, float, float] | None = None,
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
        if poses is None:
            poses = range(len(np.atleast_1d(as_array("force", force))))
        data = assemble(
            {"pose": poses, "load_case": load_cases, "joint": joint_names},
            {
                "joint_position": joint_position,
                "force": force,
                "moment": moment,
                "controller_displacement": controller_displacement,
                "marker_displacement": marker_displacement,
                "status": status,
                "force_sigma": force_sigma,
                "marker_sigma": marker_sigma,
                "tcp_position": tcp_position,
            },
            joint_units or ("rad",) * len(joint_names),
            {
                "schema": SCHEMA,
                "robot_name": robot_name,
                "robot_urdf": robot_urdf,
                "tcp_frame": tcp_frame,
                "marker": None if marker is None else write_point(marker),
                "provenance": provenance,
            },
        )
        dataset = cls(data)
        check_plausible(dataset.data)
        return dataset

    @property
    def poses(self) -> tuple[int, ...]:
        """Labels of the poses, in order."""
        return tuple(self.data["pose"].values.tolist())

    @property
    def load_cases(self) -> tuple[str, ...]:
        """Names of the load cases, in order."""
        return tuple(self.data["load_case"].values.tolist())

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in the order of the file."""
        return tuple(self.data["joint"].values.tolist())

    @property
    def joint_units(self) -> tuple[str, ...]:
        """Unit of each joint position: ``"rad"`` for a revolute joint, ``"m"`` for a prismatic."""
        if "joint_unit" in self.data.coords:
            return tuple(self.data["joint_unit"].values.tolist())
        return (SI_JOINT_UNITS["angle"],) * len(self.joint_names)

    @property
    def robot_name(self) -> str:
        """Name of the robot; empty when not known."""
        return str(self.data.attrs["robot_name"])

    @property
    def robot_urdf(self) -> str | None:
        """URDF text of the robot; None when the file does not carry one."""
        return self.data.attrs.get("robot_urdf")

    @property
    def tcp_frame(self) -> str | None:
        """Link of the URDF at the tool centre point; None when the file does not name one."""
        return self.data.attrs.get("tcp_frame")

    @property
    def marker(self) -> tuple[float, float, float] | None:
        """Metrology marker in the tcp frame, in m; None: at the tcp, or the file does not say."""
        text = self.data.attrs.get("marker")
        return None if text is None else read_point("marker", str(text))

    @property
    def provenance(self) -> str:
        """Where the data come from; empty when not known."""
        return str(self.data.attrs["provenance"])

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
        data = self.data
        if poses is not None:
            data = data.isel(pose=_positions("pose", poses, self.poses))
        if load_cases is not None:
            data = data.isel(load_case=_positions("load case", load_cases, self.load_cases))
        elif usable(data).any():
            data = data.isel(load_case=np.flatnonzero(usable(data).any(axis=0)))
        return Dataset(data)

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
        ok = usable(self.data)
        pose, case = np.nonzero(ok)
        return Readings(
            pose=self.data["pose"].values[pose],
            load_case=self.data["load_case"].values[case],
            joint_position=self.data["joint_position"].values[ok][:, order],
            force=self.data["force"].values[ok],
            controller_displacement=self.data["controller_displacement"].values[ok],
            marker_displacement=self.data["marker_displacement"].values[ok],
            moment=self._optional("moment", ok),
            force_sigma=self._optional("force_sigma", ok),
            marker_sigma=self._optional("marker_sigma", ok),
            tcp_position=self._optional("tcp_position", pose),
        )

    def _optional(self, name: str, index: np.ndarray) -> FloatArray | None:
        return self.data[name].values[index] if name in self.data else None


def _positions(kind: str, labels: Sequence[Any], known: Sequence[Hashable]) -> list[int]:
    for label in labels:
        if label not in known:
            listed = ", ".join(map(str, known[:20])) + (", …" if len(known) > 20 else "")
            names = [name for name in known if isinstance(name, str)]
            hint = nearest(label, names) if isinstance(label, str) else ""
            raise DatasetError(f"{kind} {label!r} is not in the dataset{hint} (known: {listed})")
    return [known.index(label) for label in labels]
