"""All springs of the simulated robot at once: gears with stiffening, lost motion and friction.

The torque of a gear over its twist is

    tau(x) = k x - sum_m L_m a_m atan(x / a_m) + sum_i kappa_i clip(x - s_i, -d_i, d_i)

*Growth and backlash* (the sum over m): near rest the stiffness is smaller by ``L_m``, and half of
that is regained at the twist ``a_m``; see `_softening`. A small ``a_m`` with nearly all of ``k`` is
a smoothed play: beyond it the twist is larger by ``b / 2`` with ``b = pi a_m L_m / k``, so that a
torque and its opposite are ``b`` further apart.

*Friction in the teeth* (the sum over i): springs ``kappa_i`` in parallel, each with a slider that
slips at the travel ``d_i``: the stop operators of Prandtl and Ishlinskii (A. Visintin,
"Differential Models of Hysteresis", Springer 1994, chapter III). The torque then depends on the
positions ``s_i`` of the sliders, which are the memory; it does not depend on speed. A reversal
starts stiff and ends ``2 sum kappa_i d_i`` below the torque of loading; loops close at once
(Masing's rule).

*Lost motion* ``w`` is the width of that loop at no torque. Each branch crosses zero where the
elastic torque ``g`` is the friction's, so ``sum kappa_i d_i = g(w / 2)`` gives the friction of a
gear whose lost motion a catalogue states; it then includes play.

*After a free move*, a gear that last moved by a stroke ``v`` has strains ``clip(v, -d_i, d_i)``,
held while the free robot comes to rest.

The seals of the balancer's cylinder have friction, too: one more stop parallel to the gear of axis
2, whose torque is the seals' force times the balancer's lever arm at that posture.

The estimator's stops act on *torque*, with a compliance in arc tangents of torque; the stops here
act on *twist*, in parallel with a nonlinear spring, so that neither is the inverse of the other.

At given sliders the torque has a potential, so that an equilibrium is a minimum; afterwards the
sliders follow. That is exact as long as no gear reverses within one step of load.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.errors import SpringError
from elastocal.results import brief_repr
from elastocal.sim.arm.springs import SpringResponse
from elastocal.sim.truth import Gears

_STOPS = 4
"""Number of sliders of a gear's friction."""
_SEAL_TRAVEL = 20e-6
"""Travel of a seal before it slides, in m. An assumption."""
_PLAY_FLOOR = 0.2
"""Stiffness in the middle of the backlash over that at high torque: soft, not free."""


@dataclass(frozen=True)
class BalancerSpring:
    """A gravity balancer: a spring between carousel and arm, beside the gear of axis 2.

    One end sits at the distance ``a`` from the axis on the carousel, above it, the other at the
    distance ``b`` on the arm. With ``alpha`` the angle of the arm from upright the spring is

        L(alpha)² = a² + b² - 2 a b cos(alpha)

    long, stores ``E = k (L - L_0)² / 2``, and pulls the arm up with ``dE/dalpha``. With
    ``L_0 = 0`` that is ``k a b sin(alpha)``, which balances a weight at every angle (the
    zero-free-length spring); a real one has a free length, so that its torque and its stiffness
    depend on the angle. Source of the mechanism: A. Klimchik, Y. Wu, C. Dumas, S. Caro, B. Furet,
    A. Pashkevich, "Identification of geometrical and elastostatic parameters of heavy industrial
    robots", ICRA 2013, who find that a compensator makes the stiffness of axis 2 depend on its
    angle.
    """

    rate: float
    """k in N/m."""
    free_length: float
    """L_0 in m."""
    anchor: float
    """a in m."""
    lever: float
    """b in m, other than ``anchor``."""
    upright: float
    """Joint angle at which the arm is upright, in rad."""
    seal_friction: float = 0.0
    """Friction of the cylinder's seals, in N."""

    def seal_torque(self, angle: FloatArray) -> FloatArray:
        """Return the friction of the seals about the axis, in N·m.

        Parameters
        ----------
        angle : ndarray
            Angle of the joint in rad.
        """
        alpha = angle - self.upright
        product = self.anchor * self.lever
        length = np.sqrt(self.anchor**2 + self.lever**2 - 2.0 * product * np.cos(alpha))
        torque: FloatArray = self.seal_friction * np.abs(product * np.sin(alpha)) / length
        return torque

    def evaluate(self, angle: FloatArray) -> SpringResponse:
        """Return energy in J, torque dE/dalpha in N·m and stiffness d²E/dalpha² in N·m/rad.

        Parameters
        ----------
        angle : ndarray
            Angle of the joint, twist of its gear included, in rad.
        """
        alpha = angle - self.upright
        product = self.anchor * self.lever
        length = np.sqrt(self.anchor**2 + self.lever**2 - 2.0 * product * np.cos(alpha))
        stretch = length - self.free_length
        slope = product * np.sin(alpha) / length
        bend = product * np.cos(alpha) / length - slope**2 / length
        return (
            0.5 * self.rate * stretch**2,
            self.rate * stretch * slope,
            self.rate * (slope**2 + stretch * bend),
        )


@dataclass(frozen=True)
class StiffeningGear:
    """The law of the module without backlash and friction, as a torque law of a single spring."""

    k: float
    """Stiffness at rest, makers' K1, in N·m/rad."""
    growth: float
    """1 - K1/K3: what is missing at rest, over the stiffness at high torque."""
    angle: float
    """Twist at which it is half-way between the two, in rad."""

    def __post_init__(self) -> None:
        if not (0.0 < self.k < np.inf and 0.0 <= self.growth < 1.0 and 0.0 < self.angle < np.inf):
            raise SpringError(f"{self} must have k, angle above 0 and growth from 0 to below 1")

    def evaluate(self, angle: FloatArray) -> SpringResponse:
        """Return energy, torque and stiffness."""
        high = self.k / (1.0 - self.growth)
        energy, torque, stiffness = _softening(angle, np.array(high - self.k), np.array(self.angle))
        return 0.5 * high * angle**2 - energy, high * angle - torque, high - stiffness


@brief_repr
@dataclass(frozen=True, eq=False)
class GearLaws:
    """Growth, backlash and friction of the gears, beside their stiffness at high torque."""

    which: IndexArray
    """Numbers of the springs that are gears, shape (gear,)."""
    loss: FloatArray
    """L: stiffness that is missing at rest, shape (gear, effect), in N·m/rad."""
    angle: FloatArray
    """a: twist at which half of it is back, shape (gear, effect), in rad."""
    stop_stiffness: FloatArray
    """kappa, shape (gear, stop), or (posture, gear, stop) where seals rub, in N·m/rad."""
    stop_travel: FloatArray
    """d, shape (gear, stop), in rad."""
    residual: float = 0.0
    """Standard deviation of the last stroke of a free move, in rad."""

    @classmethod
    def of(cls, entry: Gears, which: IndexArray, stiffness: FloatArray) -> "GearLaws":
        """Return growth, backlash and friction of gears.

        Parameters
        ----------
        entry : Gears
            What the cell file says.
        which : ndarray of int, shape (gear,)
            Which springs they are.
        stiffness : ndarray, shape (gear,)
            At high torque, in N·m/rad.
        """
        play = 1.0 - entry.growth - _PLAY_FLOOR if entry.backlash > 0.0 else 0.0
        play_angle = entry.backlash / (math.pi * play) if play else 1.0
        loss = np.multiply.outer(stiffness, [entry.growth, play])
        angle = np.broadcast_to([entry.growth_angle, play_angle], loss.shape)
        travel = entry.presliding * np.arange(1, _STOPS + 1) / _STOPS
        if entry.lost_motion is None:
            friction = entry.hysteresis * entry.reference_angle * stiffness
        else:
            half = 0.5 * np.array(entry.lost_motion)
            friction = stiffness * half - _softening(half[:, None], loss, angle)[1].sum(axis=1)
        return cls(
            which=which,
            loss=loss,
            angle=angle,
            stop_stiffness=friction[:, None] / (_STOPS * travel),
            stop_travel=np.broadcast_to(travel, (len(which), _STOPS)),
            residual=entry.residual * entry.presliding,
        )

    @property
    def friction(self) -> FloatArray:
        """Torque of all stops of each gear, shape (gear,), in N·m: half the height of its loop."""
        height: FloatArray = np.sum(self.stop_stiffness * self.stop_travel, axis=-1)
        return height

    def strain(self, stroke: FloatArray) -> FloatArray | None:
        """Return the friction that a stroke leaves, shape (..., gear, stop), in rad.

        Parameters
        ----------
        stroke : ndarray, shape (..., gear)
            Last stroke of each gear in standard deviations.
        """
        if self.residual == 0.0:
            return None
        travel = self.stop_travel
        return np.clip(self.residual * stroke[..., None], -travel, travel)

    def with_seals(self, lever: float) -> "GearLaws":
        """Return the laws with one more stop, for the seals beside one of the gears.

        Parameters
        ----------
        lever : float
            Longest lever of the cylinder, in m: seals yield by `_SEAL_TRAVEL` before they slide.
        """
        column = np.zeros((len(self.which), 1))
        travel = np.concatenate([self.stop_travel, column + _SEAL_TRAVEL / lever], axis=1)
        stiffness = np.concatenate([self.stop_stiffness, column], axis=1)
        return replace(self, stop_stiffness=stiffness, stop_travel=travel)

    def rubbing(self, gear: int, torque: FloatArray) -> "GearLaws":
        """Return the laws with the seals' friction, shape () or (posture,), in N·m."""
        base = self.stop_stiffness
        stiffness = np.broadcast_to(base, (*torque.shape, *base.shape[-2:])).copy()
        stiffness[..., gear, -1] = torque / self.stop_travel[gear, -1]
        return replace(self, stop_stiffness=stiffness)


@brief_repr
@dataclass(frozen=True, eq=False)
class RobotSprings:
    """Springs of the robot with the memory of its gears: a `SpringBank`."""

    stiffness: FloatArray
    """k: at high torque, shape (spring,), in N·m/rad or N/m."""
    gears: GearLaws
    slider: FloatArray | None
    """s: positions of the sliders, shape (gear, stop) or (posture, gear, stop), in rad; None: no
    friction."""
    balancer: BalancerSpring | None
    balanced: int
    """Number of the spring parallel to the balancer."""
    joint_angle: FloatArray
    """Angle that the motor of the balanced joint holds, shape () or (posture,), in rad."""
    strain: FloatArray | None = None
    """Strains that friction keeps while the robot is free, shape (..., gear, stop), in rad."""

    def evaluate(self, theta: FloatArray) -> SpringResponse:
        """Return energy (batch,), torques and stiffnesses (batch, spring); see the module.

        Parameters
        ----------
        theta : ndarray, shape (batch, spring)
            Spring positions in rad or m.
        """
        torque = self.stiffness * theta
        energy = 0.5 * np.sum(torque * theta, axis=1)
        stiffness = np.empty_like(theta)
        stiffness[:] = self.stiffness
        which, law = self.gears.which, self.gears
        twist = theta[:, which, None]
        lost = _softening(twist, law.loss, law.angle)
        torque[:, which] -= np.sum(lost[1], axis=2)
        stiffness[:, which] -= np.sum(lost[2], axis=2)
        energy -= np.sum(lost[0], axis=(1, 2))
        if self.slider is not None:
            drawn = twist - self.slider
            held = np.clip(drawn, -law.stop_travel, law.stop_travel)
            torque[:, which] += np.sum(law.stop_stiffness * held, axis=2)
            stiffness[:, which] += np.sum(law.stop_stiffness * (held == drawn), axis=2)
            energy += np.sum(law.stop_stiffness * (held * drawn - 0.5 * held**2), axis=(1, 2))
        elif self.strain is not None:
            kept = np.sum(law.stop_stiffness * self.strain, axis=-1)
            torque[:, which] += kept
            energy += np.sum(kept * theta[:, which], axis=1)
        if self.balancer is not None:
            angle = self.joint_angle + theta[:, self.balanced]
            stored, moment, rate = self.balancer.evaluate(angle)
            energy += stored
            torque[:, self.balanced] += moment
            stiffness[:, self.balanced] += rate
        return energy, torque, stiffness

    def at_joint(self, angle: FloatArray) -> "RobotSprings":
        """Return the springs with the balanced joint's motor elsewhere, in rad."""
        if self.balancer is None or self.balancer.seal_friction == 0.0:
            return replace(self, joint_angle=angle)
        gear = int(np.flatnonzero(self.gears.which == self.balanced)[0])
        rubbing = self.gears.rubbing(gear, self.balancer.seal_torque(np.asarray(angle)))
        return replace(self, joint_angle=angle, gears=rubbing)

    def strained(self, strain: FloatArray | None) -> "RobotSprings":
        """Return the springs of a free robot whose gears keep strains; see `GearLaws.strain`."""
        return replace(self, slider=None, strain=strain)

    def relaxed(self, theta: FloatArray) -> "RobotSprings":
        """Return the springs with every slider drawn to where nothing strains it.

        Parameters
        ----------
        theta : ndarray, shape (..., spring)
            Where the springs are.
        """
        stops = np.zeros_like(self.gears.stop_travel)
        return replace(self, slider=theta[..., self.gears.which, None] + stops)

    def drawn_along(self, theta: FloatArray) -> "RobotSprings":
        """Return the springs with the sliders where the equilibrium has left them.

        Parameters
        ----------
        theta : ndarray, shape (..., spring)
            Where the springs are now.
        """
        if self.slider is None:
            if self.strain is None:
                return self.relaxed(theta)
            slider = theta[..., self.gears.which, None] - self.strain
            return replace(self, slider=slider, strain=None)
        travel = self.gears.stop_travel
        twist = theta[..., self.gears.which, None]
        return replace(self, slider=twist - np.clip(twist - self.slider, -travel, travel))


def _softening(twist: FloatArray, loss: FloatArray, scale: FloatArray) -> SpringResponse:
    """Return the energy, torque and stiffness that a gear lacks near rest.

    With the stiffness ``L`` that is missing at rest and the twist ``a`` at which half of it is
    back: ``L a² (r atan(r) - log(1 + r²) / 2)``, ``L a atan(r)`` and ``L / (1 + r²)`` at
    ``r = twist / a``, each the derivative of the one before.

    Parameters
    ----------
    twist : ndarray
        In rad.
    loss : ndarray
        L in N·m/rad, of a shape that broadcasts with ``twist``.
    scale : ndarray
        a in rad, of the same shape.
    """
    ratio = twist / scale
    bend, square = np.arctan(ratio), ratio**2
    energy: FloatArray = loss * scale**2 * (ratio * bend - 0.5 * np.log1p(square))
    torque: FloatArray = loss * scale * bend
    stiffness: FloatArray = loss / (1.0 + square)
    return energy, torque, stiffness
