"""The share of the sag between reference and load that readings show.

Between the reference of a pose and a reading under load the commanded arm moves some millimetres,
so that its own weight bends it differently. Rows count this as ``S(q) - S(q_0)``
(`elastocal.identification.displacement`). Readings show less of it where the controller takes the
sag out of the positions that it reports, and during the press, when the tool stays where it is and
only the commanded arm moves on. How much less depends on the controller, and no data sheet says it:
the share ``s`` is a number beside the springs,

    d = (O(q, f) + s (S(q) - S(q_0))) c,    s = 1 + u,    u = -1/2 with a deviation of 1/2,

where ``u`` has a column in the fit, linear about the compliances that fit all of the sag. The prior
holds it where springs leave much, since more columns explain more of anything. See
docs/decisions/0154-share-of-the-sag.md.
"""

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.identification.displacement import sag_blocks_between
from elastocal.identification.options import FitOptions
from elastocal.identification.problem import OpenNumbers, Problem
from elastocal.identification.solve import solve

_LESS = 0.5
"""How much less than all of the sag is expected, and its standard deviation: none and all of it are
as far away."""


def with_sag_open(
    problem: Problem,
    model: ElasticModel,
    readings: Readings,
    used: BoolArray,
    options: FitOptions,
    marker_offset: ArrayLike | None = None,
) -> Problem:
    """Return a problem with a column of the share of the sag behind the springs and frames.

    It stays as it is where the arm has no weight, where a contact holds the tool (the reference is
    read in light contact, where nothing sags differently), and where secondary encoders see the
    sag of their joints.

    Parameters
    ----------
    problem : Problem
        Of these readings, by `elastocal.identification.build`.
    model, readings, options, marker_offset
        What it was built of.
    used : ndarray of bool, shape (reading,)
        Which readings are fitted.
    """
    if readings.contacts is not None or problem.encoders is not None:
        return problem
    sag = sag_blocks_between(model, readings, marker_offset)
    if not sag.any():
        return problem
    kept = problem.take(used)
    c = solve(kept, options.loss).compliance
    column = sag @ c[problem.springs]
    # What springs cannot express is alike in all rows of a pose, which then tell no more than one.
    rows = kept.d.size / len(np.unique(kept.block))
    noise = float(np.sqrt(rows * np.mean(np.square(kept.residuals(c)))))
    share = OpenNumbers(column[..., None], np.array([-_LESS]), _LESS, noise)
    return problem.with_sag(share, model.parameters[0].scale)
