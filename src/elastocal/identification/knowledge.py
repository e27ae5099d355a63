"""A fit with what is known of springs beforehand: bounds and priors of a spring file."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, KnownSpring
from elastocal.errors import IdentificationError
from elastocal.identification.options import MEDIAN_NORM, FitOptions, Prior, bounds
from elastocal.identification.problem import build
from elastocal.identification.solve import solve


def with_knowledge(
    options: FitOptions,
    known: Sequence[KnownSpring],
    model: ElasticModel,
    readings: Readings,
    marker_offset: ArrayLike | None = None,
) -> FitOptions:
    """Return options of a fit that uses what is known of springs.

    A prior is weighed against the noise of one component of a deflection: the robust residual of a
    fit without it.

    Parameters
    ----------
    options : FitOptions
        What else was chosen.
    known : sequence of KnownSpring
        What is known; the options as they are without any.
    model : ElasticModel
        Robot and springs.
    readings : Readings
        Measurements, joints in the robot's order.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m.

    Raises
    ------
    IdentificationError
        If a spring is not the model's, or bounds contradict those of the options.
    """
    if not known:
        return options
    names = list(model.parameter_names)
    unknown = [each.name for each in known if each.name not in names]
    if unknown:
        raise IdentificationError(f"the model has no spring {unknown[0]!r} to know anything of")
    natural = [parameter.lower for parameter in model.parameters]
    lower, upper = (np.array(each) for each in bounds(options, len(names), natural))
    mean, sigma = np.zeros(len(names)), np.full(len(names), np.inf)
    for each in known:
        index = names.index(each.name)
        lower[index] = lower[index] if each.low is None else max(lower[index], each.low)
        upper[index] = upper[index] if each.high is None else min(upper[index], each.high)
        if each.compliance is not None and each.sigma is not None:
            mean[index], sigma[index] = each.compliance, each.sigma
    bounded = replace(options, lower=lower, upper=upper, prior=None)
    if not np.isfinite(sigma).any():
        return bounded
    problem = build(model, readings, bounded, marker_offset)
    residual = np.linalg.norm(problem.residuals(solve(problem, "huber").compliance), axis=1)
    # Readings without any noise leave a prior no part, but not none at all.
    smallest = np.finfo(float).eps * float(np.abs(problem.d).max())
    noise = max(float(np.median(residual)) / MEDIAN_NORM, smallest)
    return replace(bounded, prior=Prior(mean, sigma, noise))
