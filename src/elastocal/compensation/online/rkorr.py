"""A correction as KUKA's RSI takes it."""

from elastocal.compensation.online.state import Triple


def rkorr(correction: Triple) -> tuple[float, float, float, float, float, float]:
    """Return a correction as RKorr: X, Y, Z in mm, A, B, C in degrees.

    For an absolute correction (``RSI_ON(#ABSOLUTE)``, ``HOLDON="1"``); the object POSCORR must
    name the frame that the compensator corrects in: ``base`` is its ``RobRoot`` where the model
    begins at the robot's root, ``tcp`` its ``Tool``. The orientation is not corrected.

    >>> rkorr((1e-3, 0.0, -2.5e-4))
    (1.0, 0.0, -0.25, 0.0, 0.0, 0.0)
    """
    x, y, z = correction
    return 1e3 * x, 1e3 * y, 1e3 * z, 0.0, 0.0, 0.0
