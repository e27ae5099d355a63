"""T-optimality: the trace of the information matrix, ``s1^2 + s2^2 + …``.

It is quick, and it looks at the directions that are seen well already: a plan by it tells little of
the springs that are seen badly. `elastocal plan` has it as the technique ``exchange-t``.

A. C. Atkinson, V. V. Fedorov, "The design of experiments for discriminating between two rival
models", Biometrika 62, 1975.
"""

from typing import ClassVar

import numpy as np

from elastocal.planning.search import Criterion


class TOptimal(Criterion):
    """The sum of the squares of the singular values."""

    name: ClassVar[str] = "t"

    def value(self, matrix: np.ndarray) -> np.ndarray:
        """Return the trace of information matrices, shape (..., r, r) to (...)."""
        return np.trace(matrix, axis1=-2, axis2=-1)
