"""What a user may choose about the splits."""

from dataclasses import dataclass

import numpy as np

from elastocal.errors import CodecError

RATIO = 70.0 / 30.0
"""Training to verification poses, the paper's ``r``."""


@dataclass(frozen=True)
class CodecOptions:
    """How the poses are split."""

    splits: int | None = None
    """Number ``N_cv`` of verification sets; None: as many as there are poses."""
    ratio: float = RATIO
    """Training to verification poses, ``r``."""
    seed: int = 0
    """Of the techniques that draw."""
    set_blunders_aside: bool = True
    """Leave out readings that cannot be measurements of this robot."""
    trust_conventions: bool = False
    """Go on with data that fit far better with a sign or frame read otherwise."""

    def __post_init__(self) -> None:
        if not 0.0 < self.ratio < np.inf:
            raise CodecError(
                f"ratio {self.ratio:g} of training to verification poses: must be above 0"
            )
        if not self.seed >= 0:
            raise CodecError(f"seed {self.seed}: must be 0 or above")
