"""The calibrated model, on which the compensation and every prediction are based.

Another tool than that of the calibration is a `ToolChange`: the springs belong to the arm, so a
longer cutter changes no compliance; it changes the lever arms of the force and the point of the
deflection.
"""

from __future__ import annotations  # signatures show ArrayLike by its name

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray, triple
from elastocal.elastic import ElasticModel, ModelPosture, Spring, check_vectors
from elastocal.errors import RobotError, SpringError
from elastocal.identification.displacement import slopes_by_shift
from elastocal.identification.domain import CalibratedLoads, CalibrationDomain
from elastocal.identification.encoders import EncoderZero
from elastocal.identification.extrapolation import CalibratedTorques
from elastocal.identification.observability import Observability
from elastocal.identification.prediction_doubt import PredictionDoubt, ProductionRows
from elastocal.identification.production import CoveredRows, ProductionCoverage, covered_rows
from elastocal.identification.spring_sums import sum_weights
from elastocal.identification.uncertainty import UNKNOWN_MISFIT, Misfit, interval
from elastocal.records import record
from elastocal.results import Result, brief_repr
from elastocal.robot import (
    Robot,
    T_from_xyzabc,
    parse_urdf,
    with_tool,
    without_tool_mass,
    xyzabc_from_T,
)
from elastocal.units import impossible
from elastocal.wording import mm, phrase, um

_LINK = "tool_tcp"
"""Name of the link at another tool's tcp; with a number where it is taken."""


@record()
class ToolChange:
    """The tool of a model, if it differs from the one of the calibration."""

    calibrated_tcp: str
    """Link at the tool centre point that the model was calibrated with."""
    pose: tuple[float, float, float, float, float, float]
    """New tcp in that link's frame: x, y, z in m, a, b, c in rad (Z-Y'-X'')."""
    mass: float | None = None
    """Mass of the tool in kg; None: that of the calibrated tool."""
    centre: tuple[float, float, float] | None = None
    """Centre of that mass in the new tcp's frame, in m."""

    def __post_init__(self) -> None:
        """Refuse a tool that no robot carries.

        Raises
        ------
        RobotError
            If a length, an angle or the mass is impossible in a robot cell.
        """
        for what, dimension, values in (
            ("pose of the tool", "length", self.pose[:3]),
            ("pose of the tool", "angle", self.pose[3:]),
            ("mass of the tool", "mass", () if self.mass is None else (self.mass,)),
            ("centre of mass of the tool", "length", self.centre or ()),
        ):
            problem = impossible(dimension, *values)
            if problem is not None:
                raise RobotError(f"{what} is {problem}")

    @property
    def sentence(self) -> str:
        """The tool in words."""
        lengths = ", ".join(f"{1e3 * value:.6g} mm" for value in self.pose[:3])
        angles = ", ".join(f"{np.degrees(value):.6g} deg" for value in self.pose[3:])
        mass = "" if self.mass is None else f", {self.mass:g} kg"
        return (
            f"another tool than calibrated with: tcp at {lengths}, {angles} in"
            f" {self.calibrated_tcp}{mass}"
        )


def change_tool(
    model: ElasticModel,
    before: ToolChange | None,
    T_tcp_tool: ArrayLike,
    mass: float | None = None,
    centre: ArrayLike | None = None,
) -> tuple[ElasticModel, ToolChange]:
    """Return the model at another tool's tcp, and what was changed.

    Parameters
    ----------
    model : ElasticModel
        Robot and springs.
    before : ToolChange or None
        What was changed already since the calibration.
    T_tcp_tool : array_like, shape (4, 4)
        New tcp in the model's tcp frame.
    mass : float, optional
        Mass of the new tool in kg, in place of what the tcp's link has.
    centre : array_like, shape (3,), optional
        Centre of that mass in the new tcp's frame, in m.

    Raises
    ------
    RobotError
        If the transform is not rigid, or mass and centre do not come together.
    """
    if (mass is None) != (centre is None):
        raise RobotError("a tool has both a mass and a centre of mass, or neither")
    robot = model.robot
    urdf = robot.urdf if mass is None else without_tool_mass(robot.urdf, robot.tip)
    link = _new_link(urdf)
    weight = () if mass is None or centre is None else (mass, centre)
    urdf = with_tool(urdf, robot.tip, link, T_tcp_tool, *weight)
    moved = Robot.from_urdf(urdf, link, robot.base, robot.meshes)
    moved = replace(moved, gravity=robot.gravity)
    T = np.asarray(T_tcp_tool, dtype=float)
    point = None if centre is None else np.asarray(centre, dtype=float)
    if before is not None:
        if mass is None and before.centre is not None:
            mass, point = before.mass, (np.linalg.inv(T) @ [*before.centre, 1.0])[:3]
        T = T_from_xyzabc(*before.pose) @ T
    x, y, z, a, b, c = xyzabc_from_T(T).tolist()
    change = ToolChange(
        robot.tip if before is None else before.calibrated_tcp,
        (x, y, z, a, b, c),
        mass,
        None if point is None else triple(point),
    )
    return ElasticModel(moved, model.springs), change


def _new_link(urdf: str) -> str:
    """Return a name for a link that the URDF does not have."""
    taken = {element.get("name") for element in parse_urdf(urdf).iterfind("link")}
    number, link = 2, _LINK
    while link in taken:
        link, number = f"{_LINK}_{number}", number + 1
    return link


_CHUNK = 2000
"""Configurations predicted at a time, so that the draws of a long path fit into memory."""


@dataclass(frozen=True, eq=False, repr=False)
class Prediction(Result):
    """Predicted deflections with 95 % intervals: of the fit, and of what would be measured."""

    deflection: FloatArray
    """Real minus commanded tcp position in base, shape (row, 3), in m."""
    low: FloatArray
    """Lower ends of the true deflection, shape (row, 3), in m: what another campaign would predict
    (bootstrap draws), with what the springs cannot express, and with how little is known of gears
    beyond the torques that calibration met. Without the second where the model does not know it."""
    high: FloatArray
    """Upper ends of that, shape (row, 3), in m."""
    measured_low: FloatArray
    """Lower ends of what would be measured, shape (row, 3), in m: with the noise of a measurement
    besides. NaN where the model does not know its misfit."""
    measured_high: FloatArray
    """Upper ends of that, shape (row, 3), in m."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the predicted deflection and its uncertainty."""
        size = np.linalg.norm(self.deflection, axis=1)
        fit, measured = (
            f"±{um(float(np.mean(high - low)) / 2)} mean along an axis"
            for low, high in (
                (self.low, self.high),
                (self.measured_low, self.measured_high),
            )
        )
        known = bool(np.isfinite(self.measured_low).all())
        return (
            ("rows", f"{len(size)}, predicted"),
            ("deflection", f"{mm(float(size.mean()))} mean, {mm(float(size.max()))} max"),
            ("95 % interval of the fit", fit),
            ("95 % interval of a measurement", measured if known else "not known, as the misfit"),
        )


def spring_rows(springs: Sequence[Spring], seen: Observability) -> FloatArray:
    """Return what of the springs has an interval: weights of sums of their parameters.

    Shape (row, parameter): each parameter, each characteristic of each spring, then each sum that
    is known though its springs are not (`Observability.seen_beside`).
    """
    parameters = [parameter for spring in springs for parameter in spring.parameters]
    n, first, characteristics = len(parameters), 0, list[FloatArray]()
    for spring in springs:
        for each in spring.characteristics:
            row = np.zeros(n)
            row[first : first + len(spring.parameters)] = each.weights
            characteristics.append(row)
        first += len(spring.parameters)
    sums = sum_weights(seen.seen_beside(parameters), [each.name for each in parameters])
    return np.vstack([np.eye(n), *characteristics, sums.reshape(-1, n)])


@brief_repr
@dataclass(frozen=True, eq=False)
class CalibratedModel:
    """An elastic model with identified compliances and their bootstrap draws."""

    model: ElasticModel
    compliance: FloatArray
    """Shape (spring,), in rad/(N·m) or m/N."""
    draws: FloatArray
    """Bootstrap draws, of which predictions have their intervals, shape (draw, spring)."""
    observability: Observability
    provenance: str = ""
    """Origin of the data."""
    misfit: Misfit = UNKNOWN_MISFIT
    """Bound on 95 % of the errors along an axis at left-out poses."""
    tool: ToolChange | None = None
    """Tool of the model; None: that of the calibration."""
    domain: CalibrationDomain | None = None
    """Poses and loads of the calibration; None: unknown, as in files of elastocal 0.1.0."""
    unexplained: float = float("nan")
    """Mean error at left-out poses over the mean deflection; NaN: not known."""
    on_production: PredictionDoubt | None = None
    """Uncertainty on the production that it was calibrated for; None: no production was named, or
    it belonged to another tool."""
    encoders: tuple[EncoderZero, ...] = ()
    """What secondary encoders read in the air; empty: the calibration had none."""
    spring_ends: FloatArray | None = None
    """Lower and upper ends of the 95 % intervals of springs (`spring_rows`), shape (row, 2); None:
    those of the draws. Draws serve predictions: they have the doubt whether another model is right,
    and beside a spring that a bound holds they are too near to one another."""
    tip: FloatArray | None = None
    """Where each draw has the tip, from the tcp of the model in its frame, shape (draw, 3), in m;
    None: its place is known."""

    def __post_init__(self) -> None:
        for name in ("compliance", "draws", "spring_ends", "tip"):
            if getattr(self, name) is None:
                continue
            array = np.array(getattr(self, name), dtype=float)
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @cached_property
    def ends(self) -> FloatArray:
        """Ends of the 95 % interval of each row of `spring_rows`, shape (row, 2)."""
        if self.spring_ends is not None:
            return self.spring_ends
        rows = spring_rows(self.model.springs, self.observability)
        return np.column_stack(interval(self.draws @ rows.T))

    @property
    def stiffness(self) -> FloatArray:
        """Stiffness of each spring, ``1 / c``, infinite where the compliance is zero."""
        return np.divide(
            1.0,
            self.compliance,
            out=np.full_like(self.compliance, np.inf),
            where=self.compliance != 0,
        )

    def covered_rows(
        self, q: FloatArray, force: FloatArray, moment: FloatArray | None = None
    ) -> CoveredRows | None:
        """Return which rows were calibrated; see `elastocal.identification.covered_rows`.

        None where the model does not know where it was calibrated.
        """
        if self.domain is None:
            return None
        robot = self.model.robot
        return covered_rows(robot, CalibratedLoads.of_domain(robot, self.domain), q, force, moment)

    def coverage(
        self,
        q: FloatArray,
        force: FloatArray,
        moment: FloatArray | None = None,
        course: Sequence[str] = (),
    ) -> ProductionCoverage | None:
        """Return the coverage of some rows of production; see `CoveredRows.figures`.

        None where the model does not know where it was calibrated.
        """
        found = self.covered_rows(q, force, moment)
        return None if found is None else found.figures(course)

    def doubt(
        self, q: FloatArray, force: FloatArray, moment: FloatArray | None = None
    ) -> PredictionDoubt | None:
        """Return the uncertainty of predictions along some rows; None without a load.

        Parameters
        ----------
        q : ndarray, shape (row, joint)
            In rad or m.
        force, moment : ndarray, shape (row, 3)
            On the robot at the tcp in base, in N and N·m; rows without a load are ignored.
        """
        few = ProductionRows(q, force, moment).few()
        if not len(few):
            return None
        found = self.predict(few.joint_position, few.force, few.moment)
        return PredictionDoubt.of(found.deflection, found.low, found.high)

    @property
    def tool_name(self) -> str:
        """The tool that the model is for, in words."""
        if self.tool is None:
            return phrase("{frame}, as calibrated", frame=self.model.robot.tip)
        return self.tool.sentence

    def with_tool(
        self,
        T_tcp_tool: ArrayLike,
        mass: float | None = None,
        centre: Sequence[float] | None = None,
    ) -> CalibratedModel:
        """Return the model of the same springs at another tool's tcp.

        Compliances, draws and observability are the arm's. Predictions are of the new tcp, under
        forces and moments at it; a mass changes sag and the preload of gears, nothing else.

        Parameters
        ----------
        T_tcp_tool : array_like, shape (4, 4)
            New tcp in this model's tcp frame.
        mass : float, optional
            Mass of the new tool in kg, in place of what the tcp's link has; the same by default.
        centre : array_like, shape (3,), optional
            Centre of that mass in the new tcp's frame, in m.

        Raises
        ------
        RobotError
            If the transform is not rigid, or mass and centre do not come together.
        """
        model, tool = change_tool(self.model, self.tool, T_tcp_tool, mass, centre)
        # A tool that is stated from the tip is where the tip is.
        tip = None if self.tip is None else self.tip @ np.asarray(T_tcp_tool, dtype=float)[:3, :3]
        return replace(self, model=model, tool=tool, tip=tip, on_production=None)

    @property
    def calibrated_model(self) -> ElasticModel:
        """The model at the tool that it was calibrated with."""
        if self.tool is None:
            return self.model
        robot = self.model.robot
        tip = self.tool.calibrated_tcp
        as_before = Robot.from_urdf(robot.urdf, tip, robot.base, robot.meshes)
        return ElasticModel(replace(as_before, gravity=robot.gravity), self.model.springs)

    def interval(self) -> tuple[FloatArray, FloatArray]:
        """Return the 95 % intervals of the compliances, two arrays of shape (spring,)."""
        low, high = self.ends[: len(self.compliance)].T
        return low, high

    def predict(
        self,
        q: ArrayLike,
        force: ArrayLike,
        moment: ArrayLike | None = None,
        visit: ArrayLike | None = None,
        *,
        friction: FloatArray | None = None,
    ) -> Prediction:
        """Return the deflections at configurations under loads.

        Parameters
        ----------
        q : array_like, shape (row, joint)
            Joint positions in rad or m.
        force : array_like, shape (row, 3)
            Force on the robot at the tcp in base, in N.
        moment : array_like, shape (row, 3), optional
            Moment on the robot about the tcp in base, in N·m.
        visit : array_like, shape (row,), optional
            Rows with one value follow one another in time and share what friction remembers, which
            is free before the first of them. Default: each row is pressed from rest.
        friction : ndarray, shape (row, element), optional
            Torque that each friction element bears, in N·m, instead.

        Raises
        ------
        RobotError, SpringError
            If an argument is not finite or has another shape.
        """
        q, force, moment = check_rows(self.model.robot, q, force, moment)
        if visit is not None and np.shape(visit) != (len(q),):
            raise SpringError(
                f"visit {np.shape(visit)} does not have a value for each of {len(q)} rows"
            )
        if friction is None and visit is not None and len(self.model.friction):
            load = self.model.load_torques(q, force, moment)
            friction, _ = self.model.friction.visits(self.model.weight_torques(q), load, visit)
        result = np.empty((3, len(q), 3))
        for start in range(0, len(q), _CHUNK):
            rows = slice(start, start + _CHUNK)
            m = None if moment is None else moment[rows]
            friction_torque = None if friction is None else friction[rows]
            posture = self.model.at(q[rows])
            blocks = self.model.observation_blocks(
                posture, force[rows], m, friction=friction_torque
            )
            result[0, rows] = blocks @ self.compliance
            drawn = blocks @ self.draws.T
            if self.tip is not None:
                drawn += self.shift_blocks(posture, force[rows], m, friction_torque) @ self.tip.T
            ends = interval(np.moveaxis(drawn, -1, 0))
            beyond = self._beyond_calibrated(posture, force[rows], m)
            result[1:, rows] = widened(result[0, rows], *ends, beyond)
        deflection, low, high = result
        size = np.linalg.norm(deflection, axis=1, keepdims=True)
        return Prediction(
            deflection,
            *widened(deflection, low, high, self.misfit.of_the_springs(size)),
            *widened(deflection, low, high, self.misfit.error(size)),
        )

    def shift_blocks(
        self,
        posture: ModelPosture,
        force: FloatArray,
        moment: FloatArray | None = None,
        friction: FloatArray | None = None,
    ) -> FloatArray:
        """Return what a shift of the tip along each axis of the tcp adds, shape (row, 3, 3).

        In m per m. The force then acts at the shifted point, whose displacement is wanted.

        Parameters
        ----------
        posture, force, moment, friction
            As for `ElasticModel.observation_blocks`, a row each.
        """
        R = self.model.robot.forward(posture.q)[:, :3, :3]
        base = np.zeros_like(force) if moment is None else moment

        def displacement(by: FloatArray) -> FloatArray:
            m = base + np.cross(R @ by, force)
            blocks = self.model.observation_blocks(posture, force, m, by, friction)
            return np.asarray(blocks @ self.compliance)

        return slopes_by_shift(displacement)

    @cached_property
    def _calibrated_torques(self) -> CalibratedTorques | None:
        """Total torques of the calibration; none where it does not matter or is not known."""
        if self.domain is None or not self.model.bears_weight:
            return None
        return CalibratedTorques.of(self.calibrated_model, self.domain)

    def _beyond_calibrated(
        self, posture: ModelPosture, force: FloatArray, moment: FloatArray | None
    ) -> FloatArray | float:
        """Return the error of gears beyond the torques of the calibration, shape (row, 3), in m."""
        torques = self._calibrated_torques
        if torques is None:
            return 0.0
        load = self.model.load_torques(posture, force, moment)
        return torques.error(self.model, self.compliance, posture, load)


def widened(
    deflection: FloatArray, low: FloatArray, high: FloatArray, error: FloatArray | float
) -> tuple[FloatArray, FloatArray]:
    """Return the ends of intervals widened by a further error, as independent errors add up.

    Parameters
    ----------
    deflection, low, high : ndarray, shape (row, 3)
        Predictions and ends of their intervals, in m.
    error : ndarray, shape (row, 3) or (row, 1), or float
        Half of the interval of the further error, in m.
    """
    # The point estimate may lie outside the draws when a spring is at its bound.
    below, above = np.maximum(deflection - low, 0.0), np.maximum(high - deflection, 0.0)
    return deflection - np.hypot(below, error), deflection + np.hypot(above, error)


def check_rows(
    robot: Robot, q: ArrayLike, force: ArrayLike, moment: ArrayLike | None
) -> tuple[FloatArray, FloatArray, FloatArray | None]:
    """Return rows of joint positions, forces and moments as arrays; see `CalibratedModel.predict`.

    Raises
    ------
    RobotError, SpringError
        If they are not finite or have other shapes.
    """
    joints, forces = robot.check_positions(q), check_vectors("force", force)
    moments = None if moment is None else check_vectors("moment", moment)
    for name, array in (("force", forces), ("moment", moments)):
        if array is not None and (joints.ndim != 2 or array.shape != (len(joints), 3)):
            raise SpringError(
                f"{name} {array.shape} does not have a row for each of q {joints.shape}"
            )
    return joints, forces, moments
