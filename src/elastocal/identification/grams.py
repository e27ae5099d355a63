"""Refits of one problem on many choices of poses, through summed Gram blocks.

Each pose block contributes ``[O d]^T [O d]``; a refit needs only their weighted sum. Squaring
costs half the digits, which leaves eight: enough for intervals and held-out errors, while the
fit itself goes through QR.
"""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.identification.least_squares import minimise
from elastocal.identification.problem import Problem


@dataclass(frozen=True, eq=False)
class PoseGrams:
    """Gram blocks of the column-scaled, weighted system."""

    gram: FloatArray
    """``[O d]^T [O d]`` of each pose block, shape (block, spring + 1, spring + 1)."""
    prior: FloatArray
    """The same of the prior's rows, shape (spring + 1, spring + 1)."""
    scale: FloatArray
    lower: FloatArray
    upper: FloatArray

    @classmethod
    def of(cls, problem: Problem) -> "PoseGrams":
        """Return the Gram blocks of a problem, in the order of its sorted block numbers."""
        scaled = problem.scaled()
        deflection = (problem.d * problem.weight)[..., None]
        rows = np.concatenate([scaled.rows, deflection], axis=2)
        blocks, index = np.unique(problem.block, return_inverse=True)
        gram = np.zeros((len(blocks), rows.shape[2], rows.shape[2]))
        np.add.at(gram, index, np.swapaxes(rows, 1, 2) @ rows)
        prior = problem.prior_rows / np.append(scaled.scale, 1.0)
        return cls(gram, prior.T @ prior, scaled.scale, problem.lower, problem.upper)

    def refit(self, multiplicity: FloatArray) -> FloatArray:
        """Return the compliances of each choice of poses.

        Parameters
        ----------
        multiplicity : ndarray, shape (choice, block)
            How often each pose block is taken.

        Returns
        -------
        ndarray, shape (choice, spring)
        """
        total = np.tensordot(multiplicity, self.gram, axes=1) + self.prior
        n = len(self.scale)
        eigenvalues, vectors = np.linalg.eigh(total[:, :n, :n])
        s = np.sqrt(np.maximum(eigenvalues[:, ::-1], 0.0))
        Vt = np.swapaxes(vectors[:, :, ::-1], 1, 2)
        projected = (Vt @ total[:, :n, n:])[..., 0]
        y = np.divide(projected, s, out=np.zeros_like(s), where=s > 0.0)
        lower, upper = self.lower * self.scale, self.upper * self.scale
        fits = [minimise(*system, lower, upper) for system in zip(s, Vt, y, strict=True)]
        return np.array(fits) / self.scale
