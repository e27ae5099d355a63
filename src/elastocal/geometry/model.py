"""The geometric model of an arm: what a fit found, as a file, and as a URDF."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.errors import SchemaError
from elastocal.geometry.arm import KINDS, MOTION, ArmErrors, frames
from elastocal.geometry.ladder import GeometryLadder
from elastocal.geometry.positions import Positions, joint_torques
from elastocal.geometry.problem import GeometryProblem
from elastocal.identification import interval
from elastocal.records import read_json, record
from elastocal.results import brief_repr
from elastocal.robot import Robot, refusals_naming, with_joint_origins

SCHEMA = "elastocal.geometry/1"
URDF_MARK = "made by elastocal geometry"
"""Comment by which a calibrated URDF is known."""
_OFFSET = MOTION.index("offset")


@record()
class DistanceFigures:
    """Distances of markers from where they were expected, in m."""

    mean: float
    p95: float
    max: float


@record()
class HeldOutFigures:
    """Errors at poses that were left out of the fit."""

    registration: DistanceFigures
    """Of the nominal arm, its frames and markers fitted."""
    chosen: DistanceFigures


@record()
class GeometryRung:
    """A rung of the ladder."""

    rung: str
    unknowns: int
    """How many the positions tell apart."""
    held_out: DistanceFigures
    chosen: bool


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
    """What the positions do not tell apart from others; it counts as 0."""

    name: str
    why: str


@brief_repr
@record(SCHEMA)
class GeometryModel:
    """A calibrated geometry, which is also its file."""

    robot_urdf: str
    """The nominal arm."""
    tcp: str
    place: FloatArray
    """Errors of the joints' places: shifts in m and turns in rad, shape (joint, 6)."""
    motion: FloatArray
    """Errors of their motion, shape (joint, 7): `elastocal.geometry.MOTION`."""
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

    @property
    def robot(self) -> Robot:
        """The nominal arm."""
        return Robot.from_urdf(self.robot_urdf, self.tcp)

    @property
    def errors(self) -> ArmErrors:
        """Its errors."""
        return ArmErrors(self.place, self.motion)

    def predict(self, data: Positions) -> FloatArray:
        """Return where the markers are expected, in the frames of their stations, (row, marker, 3).

        Parameters
        ----------
        data : Positions
            Joints, loads and stations; its markers are not looked at.
        """
        robot = self.robot
        T = frames(robot, data.q, joint_torques(robot, data), self.errors).T_base_tcp
        points = T[:, None, :3, 3] + np.einsum("nij,mj->nmi", T[:, :3, :3], self.markers)
        S = np.stack([self.stations[name] for name in data.station.tolist()])
        return np.asarray(S[:, None, :3, 3] + np.einsum("nij,nmj->nmi", S[:, :3, :3], points))

    def calibrated_urdf(self) -> str:
        """Return the URDF with corrected origins of the joints.

        Errors of gears and compliances have no place in a URDF: they are left out.
        """
        robot = self.robot
        corrections = {}
        for index, joint in enumerate(robot.chain.joints):
            T = np.eye(4)
            T[:3, 3] = self.place[index, :3]
            T[:3, :3] = Rotation.from_rotvec(self.place[index, 3:]).as_matrix()
            offset = self.motion[index, _OFFSET] * joint.axis
            if joint.revolute:
                T[:3, :3] = T[:3, :3] @ Rotation.from_rotvec(offset).as_matrix()
            else:
                T[:3, 3] += T[:3, :3] @ offset
            corrections[joint.name] = T
        urdf = with_joint_origins(self.robot_urdf, corrections)
        return urdf.replace("</robot>", f"  <!-- {URDF_MARK}: {self.provenance} -->\n</robot>")


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
    wanted = {
        "place": (found.place, (joints, len(KINDS))),
        "motion": (found.motion, (joints, len(MOTION))),
        "markers": (found.markers, (*found.markers.shape[:1], 3)),
        **{f"stations.{name}": (T, (4, 4)) for name, T in found.stations.items()},
    }
    for name, (values, shape) in wanted.items():
        if values.shape != shape:
            raise SchemaError(f"{path}: {name} has shape {values.shape}, not {shape}")
    return found


def geometry_model(
    problem: GeometryProblem, found: GeometryLadder, provenance: str
) -> GeometryModel:
    """Return the model that a ladder has found."""
    robot, data, state = problem.robot, problem.data, found.fit.state
    low, high = interval(found.draws)
    free = set(found.fit.free.tolist())
    parameters = tuple(
        GeometryParameter(
            each.name,
            float(found.values[index]),
            each.unit,
            float(low[index]),
            float(high[index]),
            bool(high[index] - low[index] <= 2.0 * each.size),
        )
        for index, each in enumerate(problem.unknowns)
        if index in free and each.rung != "registration"
    )
    rungs = tuple(
        GeometryRung(each.rung, each.free, _figures(each.distance), each.rung == found.chosen)
        for each in found.rungs
    )
    chosen = next(each for each in rungs if each.chosen)
    return GeometryModel(
        robot_urdf=robot.urdf,
        tcp=robot.tip,
        place=state.errors.place,
        motion=state.errors.motion,
        stations=dict(zip(data.stations, state.T_station_base, strict=True)),
        markers=state.markers,
        held_out=HeldOutFigures(rungs[0].held_out, chosen.held_out),
        ladder=rungs,
        parameters=parameters,
        fixed=tuple(FixedParameter(each.name, each.why) for each in found.fit.fixed),
        blunders=tuple(sorted(set(problem.row[~found.fit.used].tolist()))),
        positions=len(problem),
        provenance=provenance,
    )


def _figures(distance: FloatArray) -> DistanceFigures:
    return DistanceFigures(
        float(distance.mean()), float(np.percentile(distance, 95)), float(distance.max())
    )
