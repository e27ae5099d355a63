"""Algorithm 1 of the paper as it reads: plain loops, nothing of elastocal.codec."""

from dataclasses import dataclass, field

import numpy as np

from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, layout
from elastocal.identification import FitOptions, build, solve
from elastocal.planning.search import Candidates, technique
from elastocal.robot import Robot


@dataclass
class Reference:
    """The arrays of Algorithm 1, as lists by verification set and number of training poses."""

    verification: list = field(default_factory=list)
    chosen: list = field(default_factory=list)
    compliance: list = field(default_factory=list)
    error_mean: list = field(default_factory=list)
    error_max: list = field(default_factory=list)


def cover(points, seed, count):
    """Return farthest-first picks from a seed; ties: lowest number."""
    picks = [seed]
    while len(picks) < count:
        best, far = None, -1.0
        for candidate in range(len(points)):
            if candidate in picks:
                continue
            near = min(((points[candidate] - points[pick]) ** 2).sum() for pick in picks)
            if near > far:
                best, far = candidate, near
        picks.append(best)
    return picks


def cover_from_centroid(points, count):
    away = [((point - points.mean(axis=0)) ** 2).sum() for point in points]
    return cover(points, int(np.argmin(away)), count)


def algorithm_1(  # noqa: PLR0913 - what a codec may vary
    robot: Robot,
    readings: Readings,
    n_splits: int,
    *,
    search: str = "cover",
    springs: str = "bearing",
    cases: tuple[str, ...] | None = None,
    options: FitOptions | None = None,
    ratio: float = 70 / 30,
    seed: int = 0,
    sizes: tuple[int, ...] | None = None,
) -> Reference:
    """Return the arrays for readings whose pose labels are the physical poses."""
    options = options or FitOptions()
    problem = build(ElasticModel(robot, layout(robot, springs)), readings, options)
    labels = sorted(set(readings.pose.tolist()))
    N = len(labels)
    N_c = round(N * ratio / (ratio + 1))
    tcp = robot.forward(readings.joint_position)[:, :3, 3]
    points = np.array([tcp[readings.pose == label].mean(axis=0) for label in labels])
    may_train = np.isin(readings.load_case, cases or np.unique(readings.load_case))
    found = Reference()
    for i in range(n_splits):
        verification = cover(points, i, N - N_c)
        training = [pose for pose in range(N) if pose not in verification]
        rows = [[], [], [], []]
        for j in sizes or range(1, N_c + 1):
            picks = choose(
                search, j, N_c, (seed, i), training, points, problem, readings, may_train
            )
            train = may_train & np.isin(readings.pose, [labels[pose] for pose in picks])
            compliance = solve(problem.take(train), options.loss).compliance
            absolute = []
            for row in np.flatnonzero(np.isin(readings.pose, [labels[p] for p in verification])):
                error = problem.O[row] @ compliance - problem.d[row]
                absolute.append([*np.abs(error), np.linalg.norm(error)])
            for kept, value in zip(
                rows,
                (picks, compliance, np.mean(absolute, axis=0), np.max(absolute, axis=0)),
                strict=True,
            ):
                kept.append(value)
        found.verification.append(verification)
        found.chosen.append(rows[0])
        found.compliance.append(rows[1])
        found.error_mean.append(rows[2])
        found.error_max.append(rows[3])
    return found


def choose(  # noqa: PLR0913 - what a technique may look at
    search, j, most, seeds, training, points, problem, readings, may_train
):
    """Return j training poses as the technique chooses them from the training side."""
    if search == "cover":
        return [training[k] for k in cover_from_centroid(points[training], j)]
    if search == "random":
        order = np.random.default_rng((*seeds, most)).permutation(len(training))
        return [training[k] for k in order[:j]]
    labels = sorted(set(readings.pose.tolist()))
    stacked = [
        problem.O[may_train & (readings.pose == labels[pose])].reshape(-1, problem.columns)
        for pose in training
    ]
    rows = np.zeros((len(training), max(map(len, stacked)), problem.columns))
    for filled, block in zip(rows, stacked, strict=True):
        filled[: len(block)] = block
    pool = Candidates(points[training], rows)
    order = technique(search).search(pool, j, np.random.default_rng((*seeds, j))).order
    return [training[k] for k in order]
