"""Expected error of a calibration on production, with an interval that may be looked at often.

Two parts add up in quadrature to the root mean square of the error's length over production,

    error² = model² + fit²,
    model² = (m - v - s²) g,             fit² = mean variance of the predictions on production:

``m`` is the mean square error of readings at left-out poses, ``v`` the part of it that another
choice of poses would change, ``s`` the noise of a reading as it states it, and ``g`` what the loads
of production make of it. What the springs cannot express grows with the load, friction and noise
hardly. With ``P² / D²`` the ratio of the mean squares of the deflections on production and at those
readings, ``g`` is that ratio where production is loaded as much or more; where it is loaded less,

    g = 1 - b (1 - P² / D²),

with ``b`` the part of ``m`` that grows with the load: the slope of the square error over the square
deflection among the readings of one pose, times ``D² / m``, within 0 and 1. Both ``v`` and the
variance on production are those of the jackknife over poses. Noise that no reading states, such as
where the arm stops, stays in ``m``: the error is overstated by it rather than understated.

The interval is that of ``m g`` over poses (jackknife), on a logarithmic scale, with Student's
distribution; its lower end is of ``fit`` alone, as unstated noise may be all the rest. A campaign
that looks after each pose and stops at the first good news looks at chance as often. So the level
of one look is the nominal level of repeated significance tests, at which the probability that any
of the looks is wrong is the stated risk (P. Armitage, C. K. McPherson, B. C. Rowe, "Repeated
significance tests on accumulating data", J. Royal Statistical Society A 132, 1969; C. Jennison and
B. W. Turnbull, "Interim analyses: the repeated confidence interval approach",
J. Royal Statistical Society B 51, 1989).
"""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri, stdtrit

from elastocal.arrays import FloatArray
from elastocal.dataset import Readings
from elastocal.errors import IdentificationError, present
from elastocal.identification.budget import stated_noise
from elastocal.identification.knowledge import with_knowledge
from elastocal.identification.ladder import choose_model
from elastocal.identification.options import FitOptions
from elastocal.identification.paired import Overlap
from elastocal.identification.prediction_doubt import ProductionForecast, ProductionRows
from elastocal.identification.problem import build
from elastocal.identification.production import poses_in_company
from elastocal.identification.solve import solve
from elastocal.identification.uncertainty import leave_poses_out
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.wording import mm

FEWEST = 8
"""Number of poses from which the error on production is estimated: below it neither the springs nor
the spread of their errors is known."""
RISK = 0.05
"""Probability that a wanted accuracy is missed, where none is stated."""
_GRID, _FARTHEST = 101, 6.0
"""Points of the quadrature, and its range in standard deviations."""
_HALVINGS, _LARGEST_BOUND = 14, 6.0
"""Steps of the search for the bound, to a thousandth, and its end."""


@brief_repr
@record()
class ProductionError:
    """Expected error of the predictions on production, root mean square of its length, in m."""

    poses: int
    """Number of poses that it was calibrated with."""
    springs: str
    """Chosen springs."""
    error: float
    """The error, in m."""
    low: float
    """Lower end of its interval, in m: of the part due to the poses, since unstated noise may be
    all the rest."""
    high: float
    """Upper end, in m."""
    model: float
    """Part that no pose removes, in m: what the springs cannot express, and unstated noise."""
    fit: float
    """Part due to the choice of poses, which more of them reduce, in m."""
    spread: float
    """Standard error of the logarithm of the mean square error at left-out poses."""
    level: float
    """Probability with which each end of the interval holds at this look alone."""

    @classmethod
    def of(
        cls, poses: int, springs: str, model: float, fit: float, spread: float, level: float
    ) -> "ProductionError":
        """Return the error of both parts, with its interval."""
        error = float(np.hypot(model, fit))
        factor = float(np.exp(0.5 * stdtrit(poses - 1, level) * spread))
        return cls(poses, springs, error, fit / factor, error * factor, model, fit, spread, level)

    def after(self, poses: int, share: float) -> "ProductionError":
        """Return the error to expect with more poses.

        Parameters
        ----------
        poses : int
            Number of poses that are added.
        share : float
            Share of the variance of the predictions on production that they leave.
        """
        both, fit = self.poses + poses, self.fit * math.sqrt(share)
        spread = self.spread * math.sqrt(self.poses / both)
        return self.of(both, self.springs, self.model, fit, spread, self.level)

    def sentence(self) -> str:
        """Return the error with its interval in words."""
        interval = f"{mm(self.low)} to {mm(self.high)}"
        return f"{self.poses} poses: expected error on production {mm(self.error)} ({interval})"


def production_error(
    robot: Robot,
    readings: Readings,
    production: ProductionRows,
    options: FitOptions,
    marker_offset: ArrayLike | None = None,
    *,
    level: float = 1.0 - RISK,
) -> ProductionError:
    """Return the error to expect on production of the calibration that `calibrate` would make.

    Parameters
    ----------
    robot, readings, options, marker_offset
        As for `choose_model`, with springs ``auto``.
    production : ProductionRows
        Where the model is to predict.
    level : float
        Probability with which each end of the interval holds; see `level_of_a_look`.

    Raises
    ------
    IdentificationError
        If there are fewer than `FEWEST` poses, or no model can be fitted.
    """
    poses = len(np.unique(readings.pose))
    if poses < FEWEST:
        raise IdentificationError(
            f"{poses} poses: the error on production is estimated from {FEWEST} on"
        )
    choice = choose_model(robot, readings, "auto", options, marker_offset, production=production)
    fit = with_knowledge(options, choice.known, choice.model, readings, marker_offset)
    problem = build(choice.model, readings, fit, marker_offset)
    held_out, compliance = leave_poses_out(problem), solve(problem).compliance
    blocks, index = np.unique(problem.block, return_inverse=True)
    count = np.bincount(index)
    errors, deflections = np.square(held_out.error), np.square(held_out.size)
    squares, sizes = (np.bincount(index, each) / count for each in (errors, deflections))
    apart = deflections - sizes[index]
    moved = np.sum(np.square(problem.O @ (held_out.compliance - compliance).T), axis=(1, 2))
    chance = np.bincount(index, moved) / count * (held_out.folds - 1) / held_out.folds
    # A pose far from all others is predicted by extrapolation when it is left out.
    near = poses_in_company(robot, readings.joint_position, problem.block)
    by_pose = np.stack([
        squares, sizes, np.bincount(index, apart * errors), np.bincount(index, np.square(apart)),
    ])[:, near]  # fmt: skip
    squares, chance = squares[near], chance[near]
    forecast = ProductionForecast.of(choice.model, problem, present(production.few(), "rows"))
    loaded = float(np.mean(np.sum(np.square(forecast.deflection), axis=1)))
    noise = stated_noise(choice.model, readings, compliance[problem.springs]).error or 0.0
    left = max(float(squares.mean() - chance.mean()) - noise**2, 0.0)
    there = _under_load(by_pose, loaded)
    others = [_under_load(np.delete(by_pose, k, axis=1), loaded) for k in range(len(squares))]
    own = Overlap.leaving_one_out(len(squares)).variance * float(
        np.var((len(squares) - 1) * np.array(others), ddof=1)
    )
    return ProductionError.of(
        poses=len(blocks),
        springs=choice.taken,
        model=math.sqrt(left * there / float(squares.mean())),
        fit=math.sqrt(forecast.variance),
        spread=math.sqrt(own) / there,
        level=level,
    )


def _under_load(by_pose: FloatArray, loaded: float) -> float:
    """Return the mean square error to expect under the loads of production, in m².

    Parameters
    ----------
    by_pose : ndarray, shape (4, pose)
        Of the readings of each pose that was left out: mean square error and mean square deflection
        in m², then the sums of products and of squares whose ratio is the slope of one over the
        other, in m⁴.
    loaded : float
        Mean square deflection on production, in m².
    """
    square, size = by_pose[:2].mean(axis=1).tolist()
    together, varied = by_pose[2:].sum(axis=1).tolist()
    if loaded >= size:
        return float(square * loaded / size)
    growing = together / varied * size / square if varied > 0.0 else 0.0
    return float(square * (1.0 - min(max(growing, 0.0), 1.0) * (1.0 - loaded / size)))


@lru_cache
def level_of_a_look(first: int, last: int, risk: float = RISK) -> float:
    """Return the level of each look so that one wrong among all of them has the stated risk.

    The errors at the looks are those of means over ever more poses: sums of independent steps,
    whose distribution, cut at each look, is carried on by quadrature.

    Parameters
    ----------
    first, last : int
        Number of poses at the first and at the last look; there is one after each pose.
    risk : float
        Probability that any of the looks is wrong.

    Examples
    --------
    >>> round(level_of_a_look(8, 8), 4)
    0.95
    >>> round(level_of_a_look(8, 31), 3)
    0.988
    """
    low, high = float(ndtri(1.0 - risk)), _LARGEST_BOUND
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _missed(first, last, middle) > risk else (low, middle)
    return float(ndtr(high))


def _missed(first: int, last: int, bound: float) -> float:
    """Return the probability that a mean over n poses is ever beyond a bound, in its deviations."""
    size = np.sqrt(first)
    before = size * np.linspace(-_FARTHEST, bound, _GRID)
    density = np.exp(-0.5 * np.square(before / size)) / (size * np.sqrt(2.0 * np.pi))
    inside = float(ndtr(bound))
    for count in range(first + 1, last + 1):
        places = np.sqrt(count) * np.linspace(-_FARTHEST, bound, _GRID)
        step = np.exp(-0.5 * np.square(places[:, None] - before)) / np.sqrt(2.0 * np.pi)
        density, before = np.trapezoid(step * density, before, axis=1), places
        inside = float(np.trapezoid(density, places))
    return 1.0 - inside
