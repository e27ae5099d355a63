"""Certify: what the data can tell about each spring.

With forces only and positions only, springs that share an origin add up to one symmetric tensor
and consecutive wrist frames share axes, so some springs can never be told apart, however many
poses are taken. Predictions need only the combinations that are observable; tables must say
which springs are not (spec section 2, trap 1).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.elastic import ElasticModel, Parameter, Spring
from elastocal.identification._least_squares import rank
from elastocal.identification._sparse_basis import sparse_basis
from elastocal.identification.problem import relative_sizes, unit_columns
from elastocal.identification.solve import Factored
from elastocal.records import record
from elastocal.results import brief_repr

_PROBES, _PROBE_SEED = 60, 0
"""Number and seed of the configurations that show what could be observed at all."""


@record()
class Term:
    """One spring (or parameter of one) in an unobservable combination."""

    spring: str
    weight: float


@brief_repr
@record()
class Observability:
    """Rank, conditioning, and the springs that cannot be told apart."""

    rank: int
    condition: float
    """Condition number of the column-scaled system over the observable directions."""
    observable: tuple[bool, ...]
    """Whether each spring is determined by itself."""
    unobservable: tuple[tuple[Term, ...], ...]
    """Combinations of compliances that the data do not see, in a sparse basis: adding any
    multiple of one of them changes no deflection that was measured. Whether it changes others
    is told by `attainable_rank`."""

    @property
    def springs(self) -> int:
        """Number of springs."""
        return len(self.observable)


def observability(system: Factored, springs: Sequence[Spring]) -> Observability:
    """Return what a factored system determines.

    Parameters
    ----------
    system : Factored
        From `solve.factor`.
    springs : sequence of Spring
        In column order.
    """
    parameters = [parameter for spring in springs for parameter in spring.parameters]
    determined = rank(system.s)
    null_space = system.Vt[determined:].T
    # The system was solved in x = scale c, so a combination of x is one of c over the scale.
    groups = _readable(null_space / system.scale[:, None], parameters)
    condition = system.s[0] / system.s[determined - 1] if determined else np.inf
    mixed = {term.spring for group in groups for term in group}
    observable = tuple(parameter.name not in mixed for parameter in parameters)
    return Observability(determined, float(condition), observable, groups)


def attainable_rank(model: ElasticModel, marker_offset: ArrayLike | None = None) -> int:
    """Return the rank that any number of poses and forces would reach.

    Below it, poses or load cases are missing and predictions elsewhere are not covered; at it,
    what is not observable never matters for a deflection under a force.

    Parameters
    ----------
    model : ElasticModel
        Robot and springs.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m.
    """
    limits = model.robot.limits
    lower, upper = np.maximum(limits.lower, -np.pi), np.minimum(limits.upper, np.pi)
    rng = np.random.default_rng(_PROBE_SEED)
    q = rng.uniform(lower, upper, (_PROBES, len(lower)))
    blocks = model.observation_blocks(q[:, None], np.eye(3), marker_offset=marker_offset)
    n = len(model.parameters)
    rows = unit_columns(blocks.reshape(-1, 3, n), relative_sizes(model.parameters)).rows
    s = np.linalg.svd(rows.reshape(-1, n), compute_uv=False)
    return rank(np.asarray(s, dtype=float))


def _readable(
    null_space: FloatArray, parameters: Sequence[Parameter]
) -> tuple[tuple[Term, ...], ...]:
    """Return the null space of the compliances, by name."""
    joints = list(dict.fromkeys(parameter.joint for parameter in parameters))
    # Which weights count as zero is judged in multiples of sensible sizes, which have no unit.
    size = relative_sizes(parameters)
    orthonormal = np.linalg.qr(null_space / size[:, None])[0]
    basis = sparse_basis(orthonormal, [joints.index(each.joint) for each in parameters]) * size
    return tuple(
        tuple(Term(parameters[i].name, float(vector[i])) for i in map(int, np.flatnonzero(vector)))
        for vector in basis
    )


def describe(group: Sequence[Term]) -> str:
    """Return an unobservable combination as a person would write it.

    >>> describe([Term("a4.y", 1.0), Term("a4.z", 1.0), Term("a5.axial", -1.0)])
    '(a4.y + a4.z) - a5.axial'
    """
    sides = (
        [_written(term) for term in group if term.weight > 0],
        [_written(term) for term in group if term.weight < 0],
    )
    written = [f"({' + '.join(side)})" if len(side) > 1 else side[0] for side in sides if side]
    return " - ".join(written)


def _written(term: Term) -> str:
    size = abs(term.weight)
    return term.spring if size == 1.0 else f"{size:.3g} {term.spring}"
