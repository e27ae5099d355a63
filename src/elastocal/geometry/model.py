"""The geometric model of an arm: what a fit found, as a file, and as a URDF."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.errors import GeometryError, SchemaError
from elastocal.findings import Finding
from elastocal.geometry.arm import BENDS, KINDS, MOTION, ArmErrors, JointLoads, frames
from elastocal.geometry.assumed_masses import with_assumed_masses
from elastocal.geometry.joint_functions import JointFunction
from elastocal.geometry.positions import Payload, Positions, joint_loads
from elastocal.records import read_json, record
from elastocal.results import brief_repr
from elastocal.robot import (
    BUILT_MARK,
    ChainJoint,
    Robot,
    fixed_joint_of,
    inverse_transform,
    probe_configurations,
    refusals_naming,
    same_joints,
    with_joint_origins,
    with_tool,
)
from elastocal.wording import mm

SCHEMA = "elastocal.geometry/5"
_OFFSET = MOTION.index("offset")
_DRAWN_TOOL = "tool_as_drawn"
_SAME = 1e-6
"""Largest difference of two descriptions of one arm, in m and rad."""


@record()
class DistanceFigures:
    """Distances of markers from where they were expected, in m."""

    mean: float
    p95: float
    max: float

    @classmethod
    def of(cls, distance: FloatArray) -> "DistanceFigures":
        """Return the figures of distances, shape (position,), in m."""
        p95 = float(np.percentile(distance, 95))
        return cls(float(distance.mean()), p95, float(distance.max()))


@record()
class HeldOutFigures:
    """Errors at poses that were left out of the fit."""

    registration: DistanceFigures
    """Errors of the nominal arm, its frames and markers fitted."""
    chosen: DistanceFigures


@record()
class GeometryRung:
    """A rung of the ladder."""

    rung: str
    unknowns: int
    """Number of unknowns that the positions determine."""
    held_out: DistanceFigures
    chosen: bool
    regions: DistanceFigures | None = None
    """Errors in regions of joint space that were left out; None where functions of the joints were
    not tried."""


@record()
class GeometryParameter:
    """An error of the arm, with its 95 % interval, in `unit`."""

    name: str
    value: float
    unit: str
    low: float
    high: float
    known: bool
    """Whether the interval is narrower than what one would guess without measuring."""


@record()
class FixedParameter:
    """An unknown that the positions do not determine separately; it counts as 0."""

    name: str
    why: str


@brief_repr
@record()
class ChainErrors:
    """Places and zeros of joints fitted alone: all of the arm that a URDF or a table expresses."""

    rung: str
    """The best of those without yielding and gears."""
    place: FloatArray
    """Shape (joint, 6), in m and rad."""
    offset: FloatArray
    """Shape (joint,), in rad or m."""
    markers: FloatArray
    """In the tcp, shape (marker, 3), in m."""
    held_out: DistanceFigures
    T_tcp_built: FloatArray | None = None
    """As for the whole geometry, shape (4, 4), in m."""

    @property
    def errors(self) -> ArmErrors:
        """Its errors."""
        motion = np.zeros((len(self.offset), len(MOTION)))
        motion[:, _OFFSET] = self.offset
        none = ArmErrors.none(len(motion))
        return replace(none, place=self.place.copy(), motion=motion)


@brief_repr
@record(SCHEMA, reads=tuple(f"elastocal.geometry/{n}" for n in (1, 2, 3, 4)))
class GeometryModel:
    """A calibrated geometry, which is also its file."""

    robot_urdf: str
    """The nominal arm."""
    tcp: str
    place: FloatArray
    """Errors of the joints' poses: shifts in m and rotations in rad, shape (joint, 6)."""
    motion: FloatArray
    """Errors of their motion, shape (joint, 3 + 2 orders): offset, scale, sine and cosine of each
    order from once a turn on, compliance. Two orders, or those of functions of the joints."""
    stations: dict[str, FloatArray]
    """Base in the frame of each station, shape (4, 4), in m."""
    markers: FloatArray
    """In the tcp, shape (marker, 3), in m."""
    held_out: HeldOutFigures
    ladder: tuple[GeometryRung, ...]
    parameters: tuple[GeometryParameter, ...]
    fixed: tuple[FixedParameter, ...]
    blunders: tuple[int, ...]
    """Rows (from 0) with a position that was left out."""
    positions: int
    """Positions of markers, blunders included."""
    provenance: str
    findings: tuple[Finding, ...] = ()
    """Notes on the positions for the user, a sentence each."""
    T_tcp_built: FloatArray | None = None
    """The calibrated tcp in the nominal tcp, shape (4, 4), in m; None where the positions of the
    markers on the tool are unknown."""
    chain: ChainErrors | None = None
    """Part that a URDF expresses, fitted separately; None in older files, which leave the rest
    out."""
    with_blunders: HeldOutFigures | None = None
    """As `held_out`, of every position; none in files of before."""
    functions: tuple[JointFunction, ...] = ()
    """Functions of the joints, where that rung was chosen."""
    bend: FloatArray | None = None
    """Compliances of the joints' bearings about the axes of their frames, shape (joint, 3), in
    rad/(N·m); none in files of before."""
    sag: FloatArray | None = None
    """Compliances to the own weight by assumed masses, shape (joint,), in rad/(N·m) (m/N); none
    where the description has masses, and in files of before."""

    @property
    def robot(self) -> Robot:
        """The nominal arm."""
        return Robot.from_urdf(self.robot_urdf, self.tcp)

    @property
    def errors(self) -> ArmErrors:
        """Its errors."""
        # SciPy takes no arrays that are only to be read.
        none = ArmErrors.none(len(self.place))
        bend, sag = (
            default if own is None else own.copy()
            for own, default in ((self.bend, none.bend), (self.sag, none.sag))
        )
        return ArmErrors(self.place.copy(), self.motion.copy(), bend, sag)

    @property
    def weighed(self) -> Robot:
        """The nominal arm with the masses that its sag was fitted with."""
        return self.robot if self.sag is None else with_assumed_masses(self.robot)

    def predict(self, data: Positions) -> FloatArray:
        """Return the expected markers in the frames of their stations, (row, marker, 3).

        Parameters
        ----------
        data : Positions
            Joints, loads and stations; its markers are not used.
        """
        robot = self.weighed
        loads = joint_loads(robot, data, assumed=self.sag is not None)
        T = frames(robot, data.q, loads, self.errors).T_base_tcp
        points = T[:, None, :3, 3] + np.einsum("nij,mj->nmi", T[:, :3, :3], self.markers)
        S = np.stack([self.stations[name] for name in data.station.tolist()])
        return np.asarray(S[:, None, :3, 3] + np.einsum("nij,nmj->nmi", S[:, :3, :3], points))

    def tool_of(self, robot: Robot, payload: Payload | None = None) -> Callable[..., FloatArray]:
        """Return the function that gives the tool's position of the same arm without process force.

        Parameters
        ----------
        robot : Robot
            The same arm, perhaps with another tool behind this model's tcp.
        payload : Payload, optional
            Mass of the tool beyond the model's description.

        Returns
        -------
        callable
            From joints as the controller states them, shape (row, joint), in rad or m, to the tcp
            in base, shape (row, 3), in m, under weight and payload.

        Raises
        ------
        GeometryError
            If it is another arm.
        """
        own, errors, T_tcp_tool = self.weighed, self.errors, self.tools(robot)[1]
        assumed = self.sag is not None
        weight = Payload() if payload is None else payload

        def stands(q: FloatArray) -> FloatArray:
            loads = joint_loads(own, Positions.unloaded(q, weight), assumed=assumed)
            T = frames(own, q, loads, errors).T_base_tcp
            return np.asarray((T @ T_tcp_tool)[:, :3, 3])

        return stands

    def tools(self, robot: Robot) -> tuple[FloatArray, FloatArray]:
        """Return the tool of the same arm in the nominal tcp, as drawn and as built, (4, 4), in m.

        Raises
        ------
        GeometryError
            If it is another arm.
        """
        drawn = self._way_to(robot)
        return drawn, drawn if self.T_tcp_built is None else self.T_tcp_built @ drawn

    def as_drawn(self, robot: Robot) -> Robot:
        """Return the arm with a robot's tool as its controller knows it.

        Parameters
        ----------
        robot : Robot
            The same nominal arm, which is returned unchanged, or the one made by `as_built`.

        Raises
        ------
        GeometryError
            If it is another arm.
        """
        if BUILT_MARK not in robot.urdf:
            return robot
        own, T_own_tool = self.robot, self._way_to(robot)
        if np.abs(T_own_tool - np.eye(4)).max() < _SAME:
            return own
        return Robot.from_urdf(with_tool(own.urdf, own.tip, _DRAWN_TOOL, T_own_tool), _DRAWN_TOOL)

    def as_built(self, robot: Robot) -> Robot:
        """Return an arm with calibrated joint poses, and with the calibrated tcp where it is known.

        A URDF cannot express errors of gears and compliances, so the fit without them is used
        (`chain`). An error of the tcp is left out where that is the link of a moving joint.

        Parameters
        ----------
        robot : Robot
            The same arm as drawn, perhaps with another tool behind this model's tcp.

        Raises
        ------
        GeometryError
            If it is another arm, or its joints' frames lie elsewhere on their axes.
        """
        own, T_own_tool, corrections = self.robot, self._way_to(robot), {}
        joints, chain = robot.chain.joints, self._expressed()
        for index, (joint, described) in enumerate(zip(own.chain.joints, joints, strict=True)):
            gap = np.abs(joint.placement - described.placement).max()
            if not (gap < _SAME and np.abs(joint.axis - described.axis).max() < _SAME):
                raise GeometryError(
                    f"the geometry is of another description of the arm: the frame of {joint.name}"
                    " lies elsewhere"
                )
            corrections[joint.name] = _correction(chain.errors, index, joint)
        tool = fixed_joint_of(robot.urdf, robot.tip)
        if chain.T_tcp_built is not None and tool is not None:
            corrections[tool] = inverse_transform(T_own_tool) @ chain.T_tcp_built @ T_own_tool
        # Two dashes would end a comment of XML.
        after, before = mm(chain.held_out.mean), mm(self.held_out.registration.mean)
        error = f"{after} mean error at poses left out, {before} as drawn"
        made = f"{BUILT_MARK}: {self.provenance.replace('--', '- -')}; {error}"
        urdf = with_joint_origins(robot.urdf, corrections)
        urdf = urdf.replace("</robot>", f"  <!-- {made} -->\n</robot>")
        return replace(Robot.from_urdf(urdf, robot.tip, robot.base), gravity=robot.gravity)

    def calibrated_urdf(self) -> str:
        """Return the URDF of the arm as it was built; see `as_built`."""
        return self.as_built(self.robot).urdf

    def markers_on(self, built: Robot) -> FloatArray:
        """Return the markers in the tcp of an arm by `as_built`, shape (marker, 3), in m."""
        q = np.zeros((1, len(built.joint_names)))
        chain = self._expressed()
        T_base_own = frames(self.robot, q, JointLoads.none(q), chain.errors).T_base_tcp[0]
        T = inverse_transform(built.forward(q[0])) @ T_base_own
        return np.asarray(chain.markers @ T[:3, :3].T + T[:3, 3])

    def _expressed(self) -> ChainErrors:
        """Return the part that a URDF expresses."""
        if self.chain is not None:
            return self.chain
        rung, figures = next(each.rung for each in self.ladder if each.chosen), self.held_out.chosen
        offset = self.motion[:, _OFFSET]
        return ChainErrors(rung, self.place, offset, self.markers, figures, self.T_tcp_built)

    def _way_to(self, robot: Robot) -> FloatArray:
        """Return a tool of the same nominal or calibrated arm, in the tcp, shape (4, 4)."""
        own = self.robot
        if not same_joints(own, robot):
            raise GeometryError(
                f"the geometry is of an arm with the joints {', '.join(own.joint_names)}, not"
                f" {', '.join(robot.joint_names)}"
            )
        if BUILT_MARK in robot.urdf:
            own = self.as_built(own)
        some = probe_configurations(own)
        T_own_tool = np.linalg.inv(own.forward(some)) @ robot.forward(some)
        if not np.abs(T_own_tool - T_own_tool[0]).max() < _SAME:
            raise GeometryError(
                f"the geometry is of another arm than {robot.name}: from {self.tcp} to"
                f" {robot.tip} it is not the same way at all postures"
            )
        return np.asarray(T_own_tool[0])


def _correction(errors: ArmErrors, index: int, joint: ChainJoint) -> FloatArray:
    """Return the calibrated pose of a joint in its nominal frame, with its zero, shape (4, 4)."""
    T, place = np.eye(4), errors.place[index]
    T[:3, 3] = place[:3]
    T[:3, :3] = Rotation.from_rotvec(place[3:]).as_matrix()
    offset = errors.motion[index, _OFFSET] * joint.axis
    if joint.revolute:
        T[:3, :3] = T[:3, :3] @ Rotation.from_rotvec(offset).as_matrix()
    else:
        T[:3, 3] += T[:3, :3] @ offset
    return T


def read_geometry(path: Path) -> GeometryModel:
    """Return the model in a file.

    Raises
    ------
    SchemaError
        If it does not fit its schema, or its arrays do not fit its robot.
    RobotError
        If the robot in it cannot be used.
    FileAccessError
        If it cannot be read.
    """
    found = read_json(path, GeometryModel)
    with refusals_naming(path):
        joints = len(found.robot.joint_names)
    chain = found.chain
    of_chain = (
        {}
        if chain is None
        else {
            "chain.place": (chain.place, (joints, len(KINDS))),
            "chain.offset": (chain.offset, (joints,)),
            "chain.markers": (chain.markers, found.markers.shape),
        }
    )
    wanted = {
        **of_chain,
        "place": (found.place, (joints, len(KINDS))),
        # Sine and cosine of each order beside three other errors.
        "motion": (
            found.motion,
            (joints, max(len(MOTION), sum(found.motion.shape[1:2]) // 2 * 2 + 1)),
        ),
        **({} if found.bend is None else {"bend": (found.bend, (joints, len(BENDS)))}),
        **({} if found.sag is None else {"sag": (found.sag, (joints,))}),
        "markers": (found.markers, (*found.markers.shape[:1], 3)),
        **{f"stations.{name}": (T, (4, 4)) for name, T in found.stations.items()},
    }
    for name, (values, shape) in wanted.items():
        if values.shape != shape:
            raise SchemaError(f"{path}: {name} has shape {values.shape}, not {shape}")
    return found
