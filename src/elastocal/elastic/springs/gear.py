"""Gear: an axial spring that stiffens with its total torque and remembers friction."""

from typing import Literal

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.elastic.springs.expression import Quantity, atan2
from elastocal.elastic.springs.hinge import COMPLIANCE_SCALE, TORSIONAL
from elastocal.elastic.springs.spring import (
    Angles,
    Characteristic,
    OneAxisSpring,
    Parameter,
    SpringLoad,
    Tangents,
    Unit,
)
from elastocal.errors import SpringError
from elastocal.records import record
from elastocal.units import impossible
from elastocal.wording import Phrase, phrase

LOST_MOTION = Unit("rad", "arcmin", 10_800.0 / np.pi)
"""Unit of the angle between a torque and its opposite that friction leaves."""


@record()
class Gear(OneAxisSpring):
    """A gear under gravity and load together.

    With the torque ``w`` of the arm's own weight and ``t`` of the load, the load turns it by

        theta = c_0 t + sum_k c_k (T_k atan((w + t) / T_k) - T_k atan(w / T_k)) - sum_j f_j s_j.

    Every ``c >= 0``, so the angle grows with the torque and the gear stiffens with its size: the
    compliance falls from ``sum c`` without any torque to ``c_0`` far beyond every knee ``T_k``, and
    never below. Harmonic drives and RV gears stiffen in this way; makers state three stiffnesses
    K1, K2, K3. The *total* torque decides which of them applies, so a gear that gravity preloads is
    stiffer.

    The ``s_j`` are torques carried by friction, each a stop operator of the torque's history: it
    follows the torque's changes until it slides at ``+-r_j``. Their sum is a Prandtl-Ishlinskii
    operator (A. Visintin, *Differential Models of Hysteresis*, 1994, ch. III; in robot gears: M.
    Ruderman, F. Hoffmann, T. Bertram, "Modeling and identification of elastic robot joints with
    hysteresis and backlash", IEEE Trans. Industrial Electronics 56, 2009). Lost motion is twice
    ``sum f_j r_j``.

    With `plays`, friction acts in parallel to each elasticity and not in series with all of them:

        theta = c_0 t + sum_k c_k (T_k atan((w + t - s_1) / T_k) - T_k atan(w / T_k))
                + sum_j f_j (t - s_j).

    ``t - s_j`` is the play operator, so that every term grows with the torque for any history, and
    the teeth are turned by the torque that friction does not carry.
    """

    knees: tuple[float, ...] = (300.0, 1000.0, 3000.0)
    """``T_k``: torques about which the stiffness changes, in N·m."""
    slips: tuple[float, ...] = ()
    """``r_j``: torques at which friction elements slide, in N·m; empty: no friction."""
    plays: bool = False
    """Whether friction acts on each elasticity separately; older files do not state it."""
    kind: Literal["gear"] = "gear"

    def __post_init__(self) -> None:
        """Refuse torques that no gear bears.

        Raises
        ------
        SpringError
            If a knee or a slip is not above 0, or beyond what any machine bears.
        """
        for what, torques in (("knee", self.knees), ("slip", self.slips)):
            problem = impossible("moment", *torques)
            if problem is None and not all(t > 0.0 for t in torques):
                problem = f"{min(torques):g} N*m: it must be above 0"
            if problem is not None:
                raise SpringError(f"a {what} of gear {self.name!r} is {problem}")

    units = (TORSIONAL, LOST_MOTION)
    bears_weight = True

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """``c_0``, the ``c_k`` and the ``f_j``, all in rad/(N·m)."""
        names = ["hard", *(f"soft{T:.3g}" for T in self.knees)]
        names += [f"friction{r:.3g}" for r in self.slips]
        return tuple(
            Parameter(f"{self.name}.{name}", self.joint, TORSIONAL, COMPLIANCE_SCALE)
            for name in names
        )

    @property
    def characteristics(self) -> tuple[Characteristic, ...]:
        """Compliance without torque (makers' K1) and at the middle knee (K2), and lost motion."""
        sliding = (1.0 if self.plays else 0.0,) * len(self.slips)
        usual = float(np.exp(np.median(np.log(self.knees))))
        found = [
            Characteristic(
                self.name
                if torque == 0.0
                else self._name_of(phrase("at {torque} N·m", torque=f"{torque:.0f}")),
                (1.0, *(1.0 / (1.0 + (torque / T) ** 2) for T in self.knees), *sliding),
                TORSIONAL,
            )
            for torque in (0.0, usual)
        ]
        if self.slips:
            held = self.slips[0] if self.plays else 0.0
            soft = (2.0 * T * float(np.arctan2(held, T)) for T in self.knees)
            both_ways = (2.0 * r for r in self.slips)
            found.append(
                Characteristic(
                    self._name_of(phrase("lost motion")),
                    (0.0, *soft, *both_ways),
                    LOST_MOTION,
                )
            )
        return tuple(found)

    def _name_of(self, figure: Phrase) -> Phrase:
        return phrase("{spring} {figure}", spring=self.name, figure=figure)

    @property
    def friction_limits(self) -> tuple[float, ...]:
        """The ``r_j``."""
        return self.slips

    def angles(self, load: SpringLoad[Quantity]) -> Angles[Quantity]:
        """Return the angle of one unit of each parameter."""
        (t,) = load.torque
        friction_torque = load.friction or tuple(0.0 * t for _ in self.slips)
        turning = t - friction_torque[0] if self.plays and friction_torque else t
        row: list[Quantity] = [t]
        row.extend(self._softness(load, turning, T) for T in self.knees)
        row.extend(t - s if self.plays else -1.0 * s for s in friction_torque)
        return (tuple(row),)

    @staticmethod
    def _softness(load: SpringLoad[Quantity], t: Quantity, T: float) -> Quantity:
        """Return ``T atan((w + t) / T) - T atan(w / T)``, as one angle.

        The tangent of a difference makes it that of ``(T^2 + (w + t) w, T t)``: nothing is lost
        where a small load meets a heavy arm, and half the arc tangents are left to compute.
        """
        w = load.weight[0] if load.weight else 0.0 * t
        return T * atan2(T * t, T * T + (w + t) * w)

    def tangents(self, load: SpringLoad[FloatArray]) -> Tangents:
        """Return 1 and ``1 / (1 + ((w + t) / T_k)^2)``, friction sliding: 0, or 1 of plays."""
        (t,) = load.torque
        turning = t - load.friction[0] if self.plays and load.friction else t
        total = turning + load.weight[0] if load.weight else turning
        soft = (1.0 / (1.0 + np.square(total / T)) for T in self.knees)
        sliding = (1.0 if self.plays else 0.0,) * len(self.slips)
        return (((1.0, *soft, *sliding),),)
