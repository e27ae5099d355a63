"""A gravity balancer: a spring between carousel and arm, beside the gear of axis 2.

One end sits at the distance ``a`` from the axis on the carousel, above it, the other at the
distance ``b`` on the arm. With ``alpha`` the angle of the arm from upright the spring is

    L(alpha)² = a² + b² - 2 a b cos(alpha)

long, stores ``E = k (L - L_0)² / 2``, and pulls the arm up with ``dE/dalpha``. With ``L_0 = 0``
that is ``k a b sin(alpha)``, which balances a weight at every angle (the zero-free-length spring);
a real one has a free length, so that its torque and its stiffness depend on the angle. Source of
the mechanism: A. Klimchik, Y. Wu, C. Dumas, S. Caro, B. Furet, A. Pashkevich, "Identification of
geometrical and elastostatic parameters of heavy industrial robots", ICRA 2013, who find that a
compensator makes the stiffness of axis 2 depend on its angle.
"""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray


@dataclass(frozen=True)
class BalancerSpring:
    """A spring beside one joint."""

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

    def evaluate(self, angle: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
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
