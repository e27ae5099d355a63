"""Print how long a geometry takes beside a plain ``scipy.optimize.least_squares`` of the same run.

The positions are planted: three markers on a KR 210 whose joints stand 0.5 mm and 0.5 mrad
elsewhere. SciPy is given the same residuals, the same unknowns, scales and start, and makes its
derivatives by differences, as programs do that hand a model to it. Both end in the same minimum.
Machines differ and are noisy: ratios count. Run with ``python benchmarks/geometry.py [POSES]``.
"""

import sys
from pathlib import Path
from time import perf_counter

import numpy as np
from scipy.optimize import least_squares

from elastocal.geometry import GeometryProblem
from elastocal.geometry.arm import frames
from elastocal.geometry.derivatives import Derivatives
from elastocal.geometry.determined import told_apart
from elastocal.geometry.ladder import climb
from elastocal.geometry.problem import State
from elastocal.geometry.solve import fit, register
from elastocal.progress import silent
from elastocal.robot import catalogue

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from timing import figure, inside

from support.measured_arms import measure

POSES = int(sys.argv[1]) if len(sys.argv) > 1 else 1000


def residuals(problem: GeometryProblem, at: State) -> np.ndarray:
    """Return how far markers were measured from where they are expected, shape (3 point,), in m."""
    T = frames(problem.robot, problem.data.q, problem.loads, at.errors).T_base_tcp[problem.row]
    points = T[:, :3, 3] + np.einsum("nij,nj->ni", T[:, :3, :3], at.markers[problem.marker])
    S = at.T_station_base[problem.station]
    predicted = S[:, :3, 3] + np.einsum("nij,nj->ni", S[:, :3, :3], points)
    return (problem.measured - predicted).ravel()


def plain(problem: GeometryProblem, free: np.ndarray, start: State) -> np.ndarray:
    """Return the residuals at SciPy's minimum."""
    size = np.array([each.size for each in problem.unknowns])

    def of(x: np.ndarray) -> np.ndarray:
        step = np.zeros(len(size))
        step[free] = size[free] * x
        return residuals(problem, problem.moved(start, step))

    return least_squares(of, np.zeros(len(free)), method="trf", xtol=1e-12, ftol=1e-12).fun


def main() -> None:
    """Time both on one problem."""
    measured = measure(catalogue.load("KR 210 R2700-2"), POSES)
    problem = GeometryProblem(measured.robot, measured.data)
    start = register(problem)
    chosen = told_apart(problem.linearise(start)[1], problem, "geometry")
    all_used = np.ones(len(problem), dtype=bool)
    begin = perf_counter()
    ours = fit(problem, chosen, start, all_used).residual
    between = perf_counter()
    theirs = plain(problem, chosen[0], start)
    end = perf_counter()
    fitted, by_scipy = between - begin, end - between
    ours, theirs = (np.linalg.norm(each.reshape(-1, 3), axis=1) for each in (ours, theirs))
    apart = np.sqrt(np.mean((ours - theirs) ** 2))
    print(f"{POSES} poses of 3 markers, {len(chosen[0])} unknowns")
    scipy = ("scipy.optimize.least_squares, one fit", by_scipy)
    figure(f"geometry: one fit of {POSES} poses of 3 markers", fitted, scipy)
    print(f"same minimum: distances {1e9 * apart:.2f} nm apart (rms)")

    def ladder() -> None:
        climb(problem, 200, np.random.default_rng(0), silent)

    begin = perf_counter()
    ladder()
    whole = perf_counter() - begin
    name = f"geometry: the whole ladder, {POSES} poses, 200 draws"
    figure(name, whole, scipy, aim=1.5 if POSES >= 16_000 else None)
    for part, owner, function in (
        ("derivatives", GeometryProblem, "linearise"),
        ("normal equations", Derivatives, "normal"),
    ):
        figure(f"{name}: {part}", inside(ladder, owner, function, 1), ("the whole ladder", whole))


if __name__ == "__main__":
    main()
