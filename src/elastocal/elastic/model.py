"""The elastic model of a robot (paper section 2.3, Eq. 1-14).

With the spring Jacobian ``J`` (translation) and ``W`` (rotation) at the tool centre point, a
force ``f`` and a moment ``m`` on the robot make the spring torques

    tau = J^T f + W^T m,                                   (Eq. 9)

and, with compliances ``c`` of linear springs, the deflection

    deflection = J diag(c) tau = O c,    O = J diag(tau).  (Eq. 10, 11, 14)

Every kind of spring is linear in its parameters, so that ``O c = deflection`` holds for all; the
spring defines its columns of ``O`` (`elastocal.elastic.springs`).

The deflection is relative to the unloaded arm at the *same* joints, already bent by gravity.
Relative to the weightless arm it is ``(O + S) c`` with the sag ``S c``; a displacement between a
reference and a loaded reading, millimetres apart, contains ``S(q) - S(q_0)`` in addition to ``O``.

Springs of one law, evaluated together, and the chain that their axes are inserted into.

Friction memory: the torque that friction carries depends on the history of the torque.

A stop operator (the building block of Prandtl-Ishlinskii hysteresis) follows the changes of a
torque until it slides at its limit:

    s_k = clip(s_{k-1} + tau_k - tau_{k-1}, -r, r).

A free motion of the joint clears the memory: after it the state is assumed near zero. A press that
changes the torque by more than ``2 r`` erases all earlier history.
"""

from __future__ import annotations  # signatures show ArrayLike by its name

from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray, IndexArray, as_numbers
from elastocal.elastic.springs import Parameter, Spring, SpringLoad, check_springs
from elastocal.errors import SpringError, require_type
from elastocal.results import brief_repr
from elastocal.robot import (
    ChainModel,
    InsertedJoint,
    Jacobian,
    Robot,
    build_model,
    evaluate_jacobian,
    evaluate_weight,
)

Columns = IndexArray | slice
"""Columns of an array; those that lie side by side as a slice, which copies nothing."""


@dataclass(frozen=True, eq=False)
class AlikeSprings:
    """Springs that share a law and so are evaluated together."""

    law: Spring
    """One of them."""
    axes: tuple[Columns, ...]
    """For each axis of the law, the column of the Jacobian of each spring."""
    parameters: tuple[Columns, ...]
    """For each parameter of the law, its place in the compliance vector for each spring."""
    friction: tuple[Columns, ...]
    """For each friction element of the law, its place among all for each spring."""

    def load(
        self,
        torque: FloatArray,
        weight: FloatArray | None = None,
        friction: FloatArray | None = None,
    ) -> SpringLoad[FloatArray]:
        """Return the loads of these springs.

        Of torques of load and weight of shape (..., axis), friction of shape (..., element).
        """
        return SpringLoad(
            tuple(torque[..., axis] for axis in self.axes),
            () if weight is None else tuple(weight[..., axis] for axis in self.axes),
            () if friction is None else tuple(friction[..., place] for place in self.friction),
        )


def insert_springs(robot: Robot, springs: Sequence[Spring]) -> tuple[ChainModel, IndexArray]:
    """Build the chain and find the column of each axis; axial ones share that of the joint."""
    joints = {joint.name: index for index, joint in enumerate(robot.chain.joints)}
    axes = [axis for spring in springs for axis in spring.axes]
    own = [axis.is_axis_of(robot.chain.joints[joints[axis.joint]]) for axis in axes]
    inserted = [
        InsertedJoint(
            axis.name,
            joints[axis.joint],
            np.array(axis.axis),
            axis.revolute,
            axis.distal,
            np.array(axis.offset),
        )
        for axis, shares in zip(axes, own, strict=True)
        if not shares
    ]
    chain = build_model(robot.chain, inserted)
    virtual = iter(chain.inserted_columns)
    columns = [
        chain.joint_columns[joints[axis.joint]] if shares else next(virtual)
        for axis, shares in zip(axes, own, strict=True)
    ]
    return chain, np.array(columns, dtype=np.intp)


def group_alike(springs: Sequence[Spring]) -> Iterator[AlikeSprings]:
    """Group springs by their law."""
    members: dict[Hashable, list[int]] = {}
    for index, spring in enumerate(springs):
        members.setdefault(spring.law, []).append(index)
    first_axis = np.cumsum([0, *(len(spring.axes) for spring in springs)])
    first_parameter = np.cumsum([0, *(len(spring.parameters) for spring in springs)])
    first_element = np.cumsum([0, *(len(spring.friction_limits) for spring in springs)])
    for indices in members.values():
        law = springs[indices[0]]
        yield AlikeSprings(
            law,
            tuple(_side_by_side(first_axis[indices] + k) for k in range(len(law.axes))),
            tuple(_side_by_side(first_parameter[indices] + k) for k in range(len(law.parameters))),
            tuple(
                _side_by_side(first_element[indices] + k) for k in range(len(law.friction_limits))
            ),
        )


def assembled(columns: Sequence[FloatArray], places: Sequence[Columns]) -> FloatArray:
    """Return columns of shape (..., 3, spring) as one array, each group at its places."""
    n = sum(column.shape[-1] for column in columns)
    blocks = np.empty((*columns[0].shape[:-1], n))
    for place, column in zip(places, columns, strict=True):
        blocks[..., place] = column
    return blocks


def _side_by_side(columns: IndexArray) -> Columns:
    start, stop = int(columns[0]), int(columns[-1]) + 1
    return slice(start, stop) if np.array_equal(columns, np.arange(start, stop)) else columns


@brief_repr
@dataclass(frozen=True, eq=False)
class FrictionElements:
    """The friction elements of all springs of a model."""

    axis: IndexArray
    """Axis, counted through the springs, whose torque each element sees, shape (element,)."""
    limit: FloatArray
    """Torque at which each slides, shape (element,), in N·m or N."""

    @classmethod
    def of(cls, springs: Sequence[Spring]) -> FrictionElements:
        """Return the elements of springs, in their order."""
        first = np.cumsum([0, *(len(spring.axes) for spring in springs)])
        axis = [first[k] for k, spring in enumerate(springs) for _ in spring.friction_limits]
        limit = [limit for spring in springs for limit in spring.friction_limits]
        return cls(np.array(axis, dtype=np.intp), np.array(limit, dtype=float))

    def __len__(self) -> int:
        return len(self.limit)

    def press(self, torque: FloatArray) -> FloatArray:
        """Return the states after a press straight from rest.

        Parameters
        ----------
        torque : ndarray, shape (..., axis)
            Change of the torque about each axis since friction bore none, in N·m.

        Returns
        -------
        ndarray, shape (..., element)
        """
        return np.clip(torque[..., self.axis], -self.limit, self.limit)

    def path(self, torque: FloatArray, start: FloatArray | None = None) -> FloatArray:
        """Return the states along a torque history.

        Parameters
        ----------
        torque : ndarray, shape (step, ..., axis)
            Total torque about each axis at each step, in order in time, in N·m.
        start : ndarray, shape (..., element), optional
            States at the first step; zero, free, by default.

        Returns
        -------
        ndarray, shape (step, ..., element)
            States, the first being the start.
        """
        seen = torque[..., self.axis]
        states = np.zeros(seen.shape)
        if start is not None:
            states[0] = start
        for step, change in enumerate(np.diff(seen, axis=0), start=1):
            states[step] = np.clip(states[step - 1] + change, -self.limit, self.limit)
        return states

    def visits(
        self,
        weight: FloatArray,
        load: FloatArray,
        visit: ArrayLike | None = None,
        memory: FloatArray | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """Return the states under loads, those of one visit one after the other in time.

        Parameters
        ----------
        weight, load : ndarray, shape (row, axis)
            Torque of the arm's own weight and of the load about each axis, in N·m.
        visit : array_like, shape (row,), optional
            Rows with one value are a visit: free before its first row, under the weight alone.
            Default: all rows are one.
        memory : ndarray, shape (element,), optional
            What the visit of the first row remembers from before: states less the whole torque.

        Returns
        -------
        states : ndarray, shape (row, element)
            In N·m.
        memory : ndarray, shape (element,)
            After the last row.
        """
        total = weight + load
        states = np.zeros((len(total), len(self)))
        if not len(total):
            return states, np.zeros(len(self)) if memory is None else memory
        labels = np.zeros(len(total)) if visit is None else np.asarray(visit)
        _, number = np.unique(labels, return_inverse=True)
        order = np.argsort(number, kind="stable")
        for rows in np.split(order, np.flatnonzero(np.diff(number[order])) + 1):
            remembers = memory is not None and rows[0] == 0
            before = memory if remembers else -weight[rows[0], self.axis]
            way = np.concatenate([np.zeros((1, total.shape[1])), total[rows]])
            states[rows] = self.path(way, before)[1:]
        return states, states[-1] - total[-1, self.axis]


@brief_repr
@dataclass(frozen=True)
class CartesianCompliance:
    """Response of a pose to a wrench at the tool centre point, in base axes."""

    translation: FloatArray
    """Displacement per force, shape (..., 3, 3), in m/N; symmetric."""
    rotation: FloatArray
    """Rotation per moment, shape (..., 3, 3), in rad/(N·m); symmetric."""
    coupling: FloatArray
    """Displacement per moment, shape (..., 3, 3), in m/(N·m); its transpose is rotation per
    force."""


@runtime_checkable
class SavedRobot(Protocol):
    """A robot as a file of results holds it."""

    def read(self) -> Robot:
        """Return the robot."""


@brief_repr
@dataclass(frozen=True, eq=False, init=False)
class ElasticModel:
    """A robot with springs; compliances are arguments, so that one model serves many fits.

    Parameters
    ----------
    robot : Robot
        The robot up to its tool centre point, or what a result of `calibrate` has as ``robot``.
    springs : iterable of Spring
        In the order of every compliance vector.

    Raises
    ------
    SpringError
        If two springs have one name, or a spring names a joint that the robot does not have.

    Examples
    --------
    >>> import elastocal as ec
    >>> result = ec.calibrate(ec.datasets.fanuc_r2000ic(), springs="actuated", draws=40)
    >>> model = ec.ElasticModel(result.robot, result.springs)
    >>> model.deflection(result.compliance, [0.0] * 6, [0.0, 0.0, 500.0]).round(6).tolist()
    [-0.000548, 7e-06, 0.002038]
    """

    robot: Robot
    springs: tuple[Spring, ...]
    parameters: tuple[Parameter, ...] = field(init=False, repr=False)
    """Parameters of all springs, in the order of every compliance vector."""
    friction: FrictionElements = field(init=False, repr=False)
    """Friction elements of all springs."""
    _chain: ChainModel = field(init=False, repr=False)
    _columns: IndexArray = field(init=False, repr=False)
    _groups: tuple[AlikeSprings, ...] = field(init=False, repr=False)

    def __init__(self, robot: Robot | SavedRobot, springs: Iterable[Spring]) -> None:
        require_type(robot, (Robot, SavedRobot), "robot", "Robot, or that of a result")
        found = robot if isinstance(robot, Robot) else robot.read()
        given: object = springs
        is_one = isinstance(given, str) or not isinstance(given, Iterable)
        listed = (given,) if is_one else tuple(springs)
        for spring in listed:
            require_type(spring, Spring, "springs", "springs, such as those of elastic.layout")
        object.__setattr__(self, "robot", found)
        object.__setattr__(self, "springs", listed)
        check_springs(self.springs, self.robot.joint_names)
        chain, columns = insert_springs(self.robot, self.springs)
        parameters = tuple(p for spring in self.springs for p in spring.parameters)
        object.__setattr__(self, "parameters", parameters)
        object.__setattr__(self, "friction", FrictionElements.of(self.springs))
        object.__setattr__(self, "_chain", chain)
        object.__setattr__(self, "_columns", columns)
        object.__setattr__(self, "_groups", tuple(group_alike(self.springs)))

    @property
    def spring_names(self) -> tuple[str, ...]:
        """Names of the springs."""
        return tuple(spring.name for spring in self.springs)

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the parameters, in the order of every compliance vector."""
        return tuple(parameter.name for parameter in self.parameters)

    def at(self, q: ArrayLike | ModelPosture) -> ModelPosture:
        """Return the model at joint positions ``q``, for several questions about them."""
        return q if isinstance(q, ModelPosture) else ModelPosture(self, q)

    def spring_jacobian(self, q: ArrayLike) -> Jacobian:
        """Return the Jacobian of the tool centre point for the springs (paper Eq. 1-3).

        Parameters
        ----------
        q : array_like, shape (..., joint)
            Joint positions in rad or m.

        Returns
        -------
        Jacobian
            Columns are the axes of the springs (one of a hinge), shape (..., 3, axis).
        """
        return evaluate_jacobian(self._chain, self.robot.check_positions(q), self._columns)

    @property
    def bears_weight(self) -> bool:
        """Whether a law depends on the torques of the arm's own weight."""
        return any(group.law.bears_weight for group in self._groups)

    def load_torques(
        self, q: ArrayLike | ModelPosture, force: ArrayLike, moment: ArrayLike | None = None
    ) -> FloatArray:
        """Return the torque of a load about each axis (paper Eq. 9), shape (..., axis), in N·m.

        Arguments as for `observation_blocks`.
        """
        return spring_torques(self.at(q).jacobian, force, moment)

    def weight_torques(self, q: ArrayLike) -> FloatArray:
        """Return the torque of the arm's own weight about each axis.

        Parameters
        ----------
        q : array_like, shape (..., joint)
            Joint positions in rad or m.

        Returns
        -------
        ndarray, shape (..., axis)
            In N·m, or N; zero where the robot's links have no masses.
        """
        q = self.robot.check_positions(q)
        if not self.robot.has_masses:
            return np.zeros((*q.shape[:-1], len(self._columns)))
        return evaluate_weight(self._chain, q, self._columns, self.robot.gravity)

    def observation_blocks(
        self,
        q: ArrayLike | ModelPosture,
        force: ArrayLike,
        moment: ArrayLike | None = None,
        marker_offset: ArrayLike | None = None,
        friction: FloatArray | None = None,
    ) -> FloatArray:
        """Return the rows of the observation matrix (paper Eq. 11, 14): ``O c = deflection``.

        ``q`` and ``force`` are broadcast over their leading axes, so that many load cases at
        one pose cost one Jacobian.

        Parameters
        ----------
        q : array_like, shape (..., joint), or ModelPosture
            Joint positions after the load case has settled, in rad or m.
        force : array_like, shape (..., 3)
            Force on the robot at the tool centre point, in base, in N.
        moment : array_like, shape (..., 3), optional
            Moment on the robot about the tool centre point, in base, in N·m.
        marker_offset : array_like, shape (3,), optional
            Point whose displacement is observed, in the tcp frame, in m: a metrology marker
            that is not at the tool centre point has its own Jacobian. Default: the tcp.
        friction : ndarray, shape (..., element), optional
            Torque that each friction element bears, in N·m (`friction`). Default: each load is
            pressed straight from rest, after a free motion.

        Returns
        -------
        ndarray, shape (..., 3, parameter)
            In m per unit of each parameter.

        Raises
        ------
        RobotError, SpringError
            If an argument has another shape or is not finite.
        """
        posture = self.at(q)
        observed = posture.observed(marker_offset)
        return self._loaded_blocks(posture, observed, force, moment, friction)

    def joint_blocks(
        self,
        q: ArrayLike | ModelPosture,
        force: ArrayLike,
        moment: ArrayLike | None = None,
        friction: FloatArray | None = None,
    ) -> FloatArray:
        """Return the rows that times ``c`` are what each joint yields about its own axis.

        What a secondary encoder behind the gear sees: springs about or along the joint's own axis.

        Parameters
        ----------
        q, force, moment, friction
            As for `observation_blocks`.

        Returns
        -------
        ndarray, shape (..., joint, parameter)
            In rad, or m, per unit of each parameter.
        """
        posture = self.at(q)
        return self._loaded_blocks(posture, posture.own_axes, force, moment, friction)

    def _loaded_blocks(
        self,
        posture: ModelPosture,
        observed: FloatArray,
        force: ArrayLike,
        moment: ArrayLike | None,
        friction: FloatArray | None,
    ) -> FloatArray:
        """Return the columns of all springs under a load; see `observation_blocks`."""
        torque = spring_torques(posture.jacobian, force, moment)
        weight = posture.weight if self.bears_weight else None
        if friction is None and len(self.friction):
            friction = self.friction.press(torque)
        return self._blocks(observed, torque, weight, friction)

    def sag_blocks(
        self, q: ArrayLike | ModelPosture, marker_offset: ArrayLike | None = None
    ) -> FloatArray:
        """Return the rows ``S`` of the sag: ``S c`` is what the arm's own weight deflects.

        Parameters
        ----------
        q, marker_offset
            As for `observation_blocks`.

        Returns
        -------
        ndarray, shape (..., 3, parameter)
            Against the arm without weight; zero where the robot's links have no masses.
        """
        posture = self.at(q)
        return self._blocks(posture.observed(marker_offset), posture.weight)

    def joint_sag_blocks(self, q: ArrayLike | ModelPosture) -> FloatArray:
        """Return the rows of what the arm's own weight turns each joint by; see `joint_blocks`."""
        posture = self.at(q)
        return self._blocks(posture.own_axes, posture.weight)

    def _blocks(
        self,
        observed: FloatArray,
        torque: FloatArray,
        weight: FloatArray | None = None,
        friction: FloatArray | None = None,
    ) -> FloatArray:
        """Return the columns of all springs, shape (..., row, parameter)."""
        places: list[Columns] = []
        columns: list[FloatArray] = []
        for group in self._groups:
            J = [observed[..., axis] for axis in group.axes]
            places += group.parameters
            columns += group.law.columns(J, group.load(torque, weight, friction))
        # Springs of one law and one parameter, such as hinges, are adjacent already.
        return columns[0] if len(columns) == 1 else assembled(columns, places)

    def deflection(
        self,
        compliance: ArrayLike,
        q: ArrayLike,
        force: ArrayLike,
        moment: ArrayLike | None = None,
        friction: FloatArray | None = None,
    ) -> FloatArray:
        """Return the deflection ``O c``: real minus commanded position of the tcp.

        Against the unloaded arm at the same joints.

        Parameters
        ----------
        compliance : array_like, shape (parameter,)
            In the units of the parameters: rad/(N·m) or m/N of hinges.
        q, force, moment, friction : array_like
            As for `observation_blocks`.

        Returns
        -------
        ndarray, shape (..., 3)
            In base, in m.
        """
        c = self.check_compliance(compliance)
        return self.observation_blocks(q, force, moment, friction=friction) @ c

    def cartesian_compliance(
        self,
        compliance: ArrayLike,
        q: ArrayLike,
        force: ArrayLike = (0.0, 0.0, 0.0),
        moment: ArrayLike | None = None,
    ) -> CartesianCompliance:
        """Return the Cartesian compliance at a pose and load: ``J diag(c) J^T`` (paper Eq. 10).

        In general ``sum_ab J_a (d theta_a / d tau_b) J_b^T`` over the axes of each spring; that
        of hinges does not depend on the load.

        Parameters
        ----------
        compliance : array_like, shape (parameter,)
            In the units of the parameters.
        q : array_like, shape (..., joint)
            Joint positions in rad or m.
        force, moment : array_like, shape (..., 3), optional
            Load at the tool centre point, in base, in N and N·m. Default: none.
        """
        c, jacobian = self.check_compliance(compliance), self.spring_jacobian(q)
        J, W = jacobian.translation, jacobian.rotation
        torques = spring_torques(jacobian, force, moment)
        weights = self.weight_torques(q) if self.bears_weight else None
        friction = self.friction.press(torques) if len(self.friction) else None
        translation, rotation, coupling = np.zeros((3, *torques.shape[:-1], 3, 3))
        for group in self._groups:
            tangents = group.law.tangents(group.load(torques, weights, friction))
            # A spring of several axes couples them: all pairs, of which a hinge has one.
            for (a, axis), (b, other) in product(enumerate(group.axes), repeat=2):
                terms = zip(group.parameters, tangents[a][b], strict=True)
                # Each of shape (spring,) or (..., spring).
                weight = np.asarray(sum(c[place] * slope for place, slope in terms))
                weighted = J[..., axis] * weight[..., None, :], W[..., axis] * weight[..., None, :]
                J_b, W_b = (np.swapaxes(part[..., other], -1, -2) for part in (J, W))
                translation += weighted[0] @ J_b
                rotation += weighted[1] @ W_b
                coupling += weighted[0] @ W_b
        return CartesianCompliance(translation, rotation, coupling)

    def compliance_at_torque(self, compliance: ArrayLike, torque: FloatArray) -> FloatArray:
        """Return the compliance about each axis at a total torque, friction sliding.

        Parameters
        ----------
        compliance : array_like, shape (parameter,)
            In the units of the parameters.
        torque : ndarray, shape (..., axis)
            Of weight and load together, in N·m or N.

        Returns
        -------
        ndarray, shape (..., axis)
            In rad/(N·m) or m/N; zero where the law of a spring does not depend on total torques.
        """
        c, found = self.check_compliance(compliance), np.zeros(torque.shape)
        for group in self._groups:
            if not group.law.bears_weight:
                continue
            tangents = group.law.tangents(group.load(torque, np.zeros_like(torque)))
            for a, axis in enumerate(group.axes):
                terms = zip(group.parameters, tangents[a][a], strict=True)
                found[..., axis] = sum(c[place] * slope for place, slope in terms)
        return found

    def directional_rows(self, q: ArrayLike, direction: ArrayLike) -> FloatArray:
        """Return the rows that times ``c`` are the compliance ``u^T C u`` along a direction.

        Of hinges the squares ``(J_i^T u)^2``; of others the tangent without load.

        Parameters
        ----------
        q : array_like, shape (..., joint)
            Joint positions in rad or m.
        direction : array_like, shape (..., 3)
            Unit vectors ``u`` in base.

        Returns
        -------
        ndarray, shape (..., parameter)
        """
        along = spring_torques(self.spring_jacobian(q), check_vectors("direction", direction))
        rows = np.empty((*along.shape[:-1], len(self.parameters)))
        weights = self.weight_torques(q) if self.bears_weight else None
        for group in self._groups:
            tangents = group.law.tangents(group.load(np.zeros_like(along), weights))
            for p, place in enumerate(group.parameters):
                rows[..., place] = sum(
                    along[..., axis] * tangents[a][b][p] * along[..., other]
                    for (a, axis), (b, other) in product(enumerate(group.axes), repeat=2)
                )
        return rows

    def check_compliance(self, compliance: ArrayLike) -> FloatArray:
        """Return compliances as a float array, or refuse them by shape or value.

        Raises
        ------
        SpringError
            If there is not one finite number a parameter.
        """
        c, n = as_numbers(compliance, "compliances"), len(self.parameters)
        if c.shape != (n,):
            each = "spring" if n == len(self.springs) else "parameter"
            raise SpringError(
                f"compliances must be {n} finite numbers, one a {each}, got shape {c.shape}"
            )
        if (wrong := np.flatnonzero(~np.isfinite(c))).size:
            name, value = self.parameter_names[wrong[0]], c[wrong[0]]
            raise SpringError(f"the compliance of {name} is {value}, not a finite number")
        return c


@brief_repr
@dataclass(frozen=True, eq=False)
class ModelPosture:
    """A model at joint positions: Jacobian and weight, each computed once and when asked for."""

    model: ElasticModel
    q: ArrayLike
    """Joint positions, shape (..., joint), in rad or m."""

    @cached_property
    def jacobian(self) -> Jacobian:
        """Jacobian of the springs, see `ElasticModel.spring_jacobian`."""
        return self.model.spring_jacobian(self.q)

    @cached_property
    def weight(self) -> FloatArray:
        """Torque of the arm's own weight about each axis, see `ElasticModel.weight_torques`."""
        return self.model.weight_torques(self.q)

    @cached_property
    def own_axes(self) -> FloatArray:
        """1 where an axis of a spring is a joint's own, shape (..., joint, axis)."""
        joints = self.model.robot.chain.joints
        axes = [axis for spring in self.model.springs for axis in spring.axes]
        own = [
            [axis.joint == each.name and axis.is_axis_of(each) for axis in axes] for each in joints
        ]
        shape = self.jacobian.translation.shape[:-2]
        return np.broadcast_to(np.array(own, dtype=float), (*shape, len(joints), len(axes)))

    @cached_property
    def joint_weight(self) -> FloatArray:
        """Torque of the arm's own weight about each joint that has an axial spring, (..., joint).

        In N·m, or N; zero about the others.
        """
        own = self.own_axes
        count = np.maximum(own.sum(axis=-1, keepdims=True), 1.0)
        return np.asarray((own / count @ self.weight[..., None])[..., 0])

    def observed(self, marker_offset: ArrayLike | None = None) -> FloatArray:
        """Return the translational Jacobian of a marker, shape (..., 3, axis), or of the tcp."""
        if marker_offset is None or not np.any(marker_offset):
            return self.jacobian.translation
        rotation = self.model.robot.forward(self.q)[..., :3, :3]
        lever = rotation @ check_vectors("marker_offset", marker_offset)
        J, W = self.jacobian.translation, self.jacobian.rotation
        return J + np.cross(W, lever[..., None], axis=-2)


def check_vectors(name: str, vectors: ArrayLike) -> FloatArray:
    """Return vectors as a float array, or refuse them by name.

    Raises
    ------
    SpringError
        If the last axis is not x, y, z or a value is not finite.
    """
    array = as_numbers(vectors, name)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise SpringError(f"{name} has shape {array.shape}: the last axis must be x, y, z")
    if not np.all(np.isfinite(array)):
        raise SpringError(f"{name} holds a value that is not finite")
    return array


def spring_torques(
    jacobian: Jacobian, force: ArrayLike, moment: ArrayLike | None = None
) -> FloatArray:
    """Return the torque about each spring, ``J^T f + W^T m`` (paper Eq. 9).

    Returns
    -------
    ndarray, shape (..., spring)
        In N·m, or N for prismatic springs.

    Raises
    ------
    SpringError
        If force or moment has another shape or is not finite.
    """
    loads = {"force": check_vectors("force", force)}
    if moment is not None:
        loads["moment"] = check_vectors("moment", moment)
    try:
        torques = loads["force"][..., None, :] @ jacobian.translation
        if moment is not None:
            torques = torques + loads["moment"][..., None, :] @ jacobian.rotation
    except ValueError as error:
        rows = jacobian.translation.shape[:-2]
        given = ", ".join(f"{name} of shape {load.shape}" for name, load in loads.items())
        raise SpringError(
            f"{given} and joint positions of {rows} rows do not go together: as many rows of each,"
            " or one, are allowed"
        ) from error
    return np.asarray(torques[..., 0, :])
