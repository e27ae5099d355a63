"""Derivatives of markers by frames, errors of the arm, and series in the angle of each joint.

A series in a joint's angle moves a marker as a turn of that joint does, times a sine or a cosine
that only depends on the angle: some five hundred columns are products of a few with waves, and are
never written out. With ``d_j`` the motion of a marker by a turn of joint ``j`` and ``t_j`` the
waves at its angle, the blocks of the normal matrix are ``sum (d_i . d_j) t_i t_j^T``.
"""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.geometry.arm import LOW_ORDERS, ORDERS, series, waves
from elastocal.results import brief_repr

_CHUNK = 2048
"""Points whose waves are written out at a time."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Derivatives:
    """Derivatives at a state, all in base; unknowns of series come last, joint by joint."""

    dense: FloatArray
    """By the other unknowns, shape (point, 3, column)."""
    turned: IndexArray
    """Columns of them by a turn of each joint with a series, shape (joint,)."""
    q: FloatArray
    """Angles of these joints, shape (row, joint), in rad."""
    row: IndexArray
    """Row of each point, shape (point,)."""

    def times(self, x: FloatArray, points: IndexArray | slice = slice(None)) -> FloatArray:
        """Return the motion of some points by a step of all unknowns, shape (point, 3), in m."""
        columns = self.dense.shape[2]
        dense, terms = self.dense[points], x[columns:]
        moved = dense @ x[:columns]
        if terms.any():
            turned = series(self.q, terms.reshape(self.joints, -1, 2), LOW_ORDERS + 1)
            moved += np.einsum("naj,nj->na", dense[:, :, self.turned], turned[self.row[points]])
        return np.asarray(moved)

    @property
    def joints(self) -> int:
        """Number of joints with a series."""
        return len(self.turned)

    def series_scores(self, residual: FloatArray, signs: FloatArray) -> FloatArray:
        """Return what residuals ask of each unknown of the series, (case, unknown), in m²/rad.

        Parameters
        ----------
        residual : ndarray, shape (point, 3)
            In m.
        signs : ndarray, shape (case, row)
            Signs of the residuals of each row.
        """
        pulled = np.zeros(self.q.shape)
        for j, column in enumerate(self.turned.tolist()):
            along = np.einsum("na,na->n", self.dense[:, :, column], residual)
            pulled[:, j] = np.bincount(self.row, along, len(self.q))
        found = 0.0
        for first in range(0, len(self.q), _CHUNK):
            part = slice(first, first + _CHUNK)
            wave = waves(self.q[part], LOW_ORDERS + 1, ORDERS)
            found = found + np.einsum(
                "cr,rj,rjk->cjk", signs[:, part], pulled[part], wave, optimize=True
            )
        return np.asarray(found).reshape(len(signs), -1)

    def normal(
        self,
        residual: FloatArray,
        weight: FloatArray,
        size: FloatArray,
        free: IndexArray,
        points: IndexArray | slice = slice(None),
    ) -> tuple[FloatArray, FloatArray]:
        """Return the normal matrix and right side of free unknowns, each in its size.

        Parameters
        ----------
        residual : ndarray, shape (point, 3)
            Measured minus expected, in m.
        weight : ndarray, shape (point,)
            Of each point.
        size : ndarray, shape (unknown,)
            Size of every unknown.
        free : ndarray of int
            Unknowns, those of series last: all or none.
        points : ndarray of int, optional
            Which points; by default all.
        """
        columns = self.dense.shape[2]
        own = free[free < columns]
        D, r, w = self.dense[points], residual[points], weight[points]
        root = np.sqrt(w)[:, None]
        A = (D[:, :, own] * size[own] * root[:, :, None]).reshape(-1, len(own))
        b = (r * root).ravel()
        if len(own) == len(free):
            return A.T @ A, A.T @ b
        p = len(own)
        G, h = np.zeros((len(free), len(free))), np.zeros(len(free))
        G[:p, :p], h[:p] = A.T @ A, A.T @ b
        turned = D[:, :, self.turned] * root[:, :, None]
        by_point, pull = A.reshape(len(D), 3, p), r * root
        row = self.row[points]
        for first in range(0, len(D), _CHUNK):
            part = slice(first, first + _CHUNK)
            self._add_series(G, h, (by_point[part], turned[part], pull[part]), row[part])
        scale = size[free]
        G[p:] *= scale[p:, None]
        G[:, p:] *= scale[p:]
        h[p:] *= scale[p:]
        i, j = np.tril_indices(len(free), -1)
        G[i, j] = G[j, i]
        return G, h

    def _add_series(
        self,
        G: FloatArray,
        h: FloatArray,
        parts: tuple[FloatArray, FloatArray, FloatArray],
        row: IndexArray,
    ) -> None:
        """Add what some points say of the series to the upper triangle of the normal matrix."""
        A, turned, b = parts
        p, joints = A.shape[2], turned.shape[2]
        # All markers of a row were seen at the same angles.
        rows, first = np.unique(row, return_index=True)
        pulled = np.add.reduceat(np.einsum("naj,na->nj", turned, b), first)
        crossed = np.add.reduceat(np.einsum("nac,naj->njc", A, turned), first)
        both = np.add.reduceat(np.einsum("nai,naj->nij", turned, turned), first)
        wave = waves(self.q[rows], LOW_ORDERS + 1, ORDERS).transpose(1, 2, 0)
        n = wave.shape[1]
        own = [slice(p + j * n, p + (j + 1) * n) for j in range(joints)]
        for i in range(joints):
            h[own[i]] += wave[i] @ pulled[:, i]
            G[:p, own[i]] += crossed[:, i].T @ wave[i].T
            for j in range(i, joints):
                G[own[i], own[j]] += (wave[i] * both[:, i, j]) @ wave[j].T
