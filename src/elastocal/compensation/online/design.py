"""The numbers of a compensator, worked out once: the Python and the C step both read them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import SENSOR_CORRECTED, SensorLoad
from elastocal.compensation.conditioning import FilterChain
from elastocal.compensation.growth import ArmGrowth
from elastocal.compensation.kernel import (
    BuiltArm,
    ModelFunctions,
    Routine,
    arm_error,
    compiled,
    deflection,
    growth,
    joint_deflections,
    observation_block,
    orientation,
    rest,
)
from elastocal.compensation.settings import CompensatorSettings
from elastocal.elastic import require_possible
from elastocal.errors import CompensationError, SpringError, nearest
from elastocal.identification import NORMAL_QUANTILE, CalibratedModel, draws_factor
from elastocal.results import brief_repr

LONG_AGO = -1.0e300
"""Time of a reading that never was, in s."""
JOINT_RANGE = 1000.0
"""Positions beyond it are no joint's, in rad or m."""
MOST_BEYOND = 3e-3
"""More than any gear turns beyond its model, in rad or m: under its permissible torque it winds up
by some 2 mrad. What a zeroed encoder sees beyond it is a lost count or a broken line."""
_PUSHING = 1e-12
"""Compliance below its smallest by which rounding may have brought it there, in SI."""
_NOTHING = 1e-9
"""Smaller deflections, in m, are rounding."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Design:
    """A compensator as numbers."""

    calibrated: CalibratedModel
    settings: CompensatorSettings
    load: SensorLoad
    deflection: Routine
    block: Routine
    orientation: Routine
    rest: Routine
    filters: FilterChain
    spread: FloatArray
    """``L`` with ``L L^T`` the covariance of the draws times 1.96², shape (spring, direction)."""
    sensor_matrix: FloatArray
    """Matrix from readings without bias to the wrench about the sensor's origin, in tcp axes, (6,
    6)."""
    weight_response: FloatArray
    """Wrench of the tool's weight per gravity, in tcp axes, shape (6, 3), in kg and kg·m."""
    gravity: FloatArray
    """In base, shape (3,), in m/s²."""
    sensor_origin: FloatArray
    """Origin of the sensor in the tcp frame, shape (3,), in m."""
    frame: FloatArray
    """R_base_frame of the correction, shape (3, 3); the identity where it is the tcp's."""
    state: ArmGrowth | None = None
    """Growth of the arm; None: unknown, or there is nothing to correct."""
    growth: Routine | None = None
    """Program of the growth; None if it is unknown."""
    links: Routine | None = None
    """Program of what joints with a secondary encoder yield; None: there are none."""
    rest_spread: FloatArray | None = None
    """`spread` without what encoders see, of the same shape; None: there are none."""
    arm_error: Routine | None = None
    """Program of the error of the unloaded tool; None where the geometry of the arm is unknown."""

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.calibrated.model.robot.joint_names)

    def functions(self) -> ModelFunctions:
        """Return the model as compiled Python, for the online step."""
        return ModelFunctions(
            orientation=compiled(self.orientation, self.joints, loaded=False),
            rest=compiled(self.rest, self.joints, loaded=False),
            deflection=compiled(self.deflection, self.joints),
            block=compiled(self.block, self.joints),
            growth=None
            if self.growth is None
            else compiled(self.growth, self.joints, loaded=False),
            links=None if self.links is None else compiled(self.links, self.joints),
        )

    @property
    def light_loads(self) -> tuple[float, ...]:
        """Torque of the load about each axis with friction below which the arm moves freely.

        In the order of the axes in the memory, in N·m or N.
        """
        friction = self.calibrated.model.friction
        share = self.settings.friction.free_below
        return tuple(
            share * float(friction.limit[friction.axis == axis].min())
            for axis in dict.fromkeys(friction.axis.tolist())
        )

    @property
    def encoders_see_friction(self) -> bool:
        """Whether secondary encoders sit at every joint whose friction the model remembers."""
        model, seen = self.calibrated.model, self.settings.encoders.joints
        axes = [axis for spring in model.springs for axis in spring.axes]
        return all(axes[n].joint in seen for n in set(model.friction.axis.tolist()))

    @property
    def weighs(self) -> bool:
        """Whether readings are raw: bias and weight are taken away, or the wrench is moved."""
        load = self.load
        moved = not np.array_equal(load.T_tcp_sensor, np.eye(4))
        moved |= load.has_matrix
        return bool(load.mass > 0.0 or load.force_bias.any() or load.moment_bias.any() or moved)

    @property
    def in_tcp(self) -> bool:
        """Whether the correction is expressed in the tcp frame."""
        return self.settings.frame == "tcp"

    @property
    def largest_step(self) -> float:
        """Largest change of the correction in one cycle, in m."""
        return self.settings.limits.rate * self.settings.cycle

    @property
    def fade_step(self) -> float:
        """Change of the correction in one cycle while it fades, in m."""
        return self.settings.limits.fade * self.settings.cycle

    @property
    def deadband_slope(self) -> float:
        """1 / deadband, in 1/m: from the deadband to twice its size the corrected share rises to 1.

        Without a deadband it rises within a nanometre, so that a deflection that is zero up to
        rounding has the same flag on every processor.
        """
        return 1.0 / max(self.settings.deadband, _NOTHING)


def design(
    calibrated: CalibratedModel,
    settings: CompensatorSettings | None = None,
    load: SensorLoad | None = None,
    state: ArmGrowth | None = None,
    built: BuiltArm | None = None,
) -> Design:
    """Work out a compensator.

    Parameters
    ----------
    calibrated : CalibratedModel
        The model.
    settings : CompensatorSettings, optional
        How it corrects; by default as the settings' own defaults say.
    load : SensorLoad, optional
        Tool weight, bias and place of the sensor; by default wrenches are taken as measured at
        the tool centre point with both removed.
    state : ArmGrowth, optional
        How far the arm has grown; by default it is as when its path was taught.
    built : BuiltArm, optional
        The calibrated geometry of the arm. The online step does not correct its errors.

    Raises
    ------
    CompensationError
        If a compliance is negative or beyond any arm's, or a filter cannot be made.
    """
    settings, load = settings or CompensatorSettings(), load or SensorLoad()
    _check_compliances(calibrated)
    _require_same_sensor(calibrated, load)
    filters = settings.chain
    frame = settings.R_base_frame
    model = calibrated.model
    grown = state is not None and state.corrects
    spread = NORMAL_QUANTILE * draws_factor(calibrated.draws)
    links, rest_spread = _of_encoders(calibrated, settings.encoders.joints, spread)
    return Design(
        calibrated=calibrated,
        settings=settings,
        load=load,
        deflection=deflection(model, calibrated.compliance.tolist()),
        block=observation_block(model, calibrated.compliance.tolist()),
        orientation=orientation(model),
        rest=rest(model),
        filters=filters,
        spread=spread,
        links=links,
        rest_spread=rest_spread,
        sensor_matrix=load.matrix_tcp,
        weight_response=load.response_tcp,
        gravity=load.gravity,
        sensor_origin=load.T_tcp_sensor[:3, 3],
        frame=np.eye(3) if frame is None else frame,
        state=state if grown else None,
        growth=growth(model.robot, state.share, state.offset) if state and grown else None,
        arm_error=None if built is None else arm_error(built),
    )


def _of_encoders(
    calibrated: CalibratedModel, joints: Sequence[str], spread: FloatArray
) -> tuple[Routine | None, FloatArray | None]:
    """Return the program of joints with encoders, and the spread of what these do not see."""
    if not joints:
        return None, None
    model, known = calibrated.model, {each.joint: each for each in calibrated.encoders}
    for joint in joints:
        if joint not in known:
            those = ", ".join(known) or "none"
            raise CompensationError(
                f"encoders.joints: joint {joint!r} had no secondary encoder in the calibration"
                f"{nearest(joint, known)} (that had: {those})"
            )
    try:
        zeros = [known[joint] for joint in joints]
        links = joint_deflections(model, calibrated.compliance.tolist(), zeros)
    except SpringError as error:
        raise CompensationError(f"encoders.joints: {error}") from error
    chain = {each.name: each for each in model.robot.chain.joints}
    seen = [
        all(axis.joint in joints and axis.is_axis_of(chain[axis.joint]) for axis in spring.axes)
        for spring in model.springs
        for _ in spring.parameters
    ]
    return links, np.where(np.array(seen)[:, None], 0.0, spread)


def _require_same_sensor(calibrated: CalibratedModel, load: SensorLoad) -> None:
    """Refuse a matrix that the forces of the model's calibration were not corrected by.

    Such a model has taken the cross-talk up: a reading that is corrected then would be wrong by it.
    """
    derived = "elastocal run" in calibrated.provenance
    if derived and SENSOR_CORRECTED not in calibrated.provenance and load.has_matrix:
        raise CompensationError(
            "the tool file corrects readings by a matrix, the model is of a run without it: run"
            " `elastocal derive RUN --tool`, calibrate again, or leave --matrix out of `tool`"
        )


def _check_compliances(calibrated: CalibratedModel) -> None:
    """Refuse an impossible model: a negative compliance corrects in the wrong direction."""
    parameters = calibrated.model.parameters
    try:
        require_possible(parameters, calibrated.compliance[None], "compliance")
        require_possible(parameters, calibrated.draws, "a draw")
    except SpringError as error:
        raise CompensationError(str(error)) from error
    for parameter, value in zip(parameters, calibrated.compliance.tolist(), strict=True):
        if value < parameter.lower - _PUSHING:
            raise CompensationError(
                f"compliance of spring {parameter.name} is {value:g} {parameter.unit.si}: a spring"
                " that moves against its load is none; calibrate without bounds below 0"
            )
