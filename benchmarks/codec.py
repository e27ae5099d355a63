"""Print how fast a codec is, beside scikit-learn's learning curve of the same run.

31 poses, 31 verification sets, 22 training sizes, 18 springs, bounded. Machines differ and are
noisy, so the ratios are what counts. scikit-learn is no dependency: install it, or put the folder
of a ``pip install --target`` on PYTHONPATH. Run with ``python benchmarks/codec.py``.
"""

import importlib.util
import warnings

import numpy as np
from timing import figure, inside, seconds

from elastocal.codec import CodecData, Variant, cross_validate, cross_validation, splits
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, layout
from elastocal.identification import _least_squares, build
from elastocal.parallel import core_count
from elastocal.robot import Robot, catalogue, with_tool
from elastocal.sim.arm import (
    SHOP_FLOOR,
    Linkage,
    bearing_truth,
    measure,
    press_forces,
    press_poses,
)

TOOL = np.array([[1.0, 0, 0, 0.15], [0, 1.0, 0, 0], [0, 0, 1.0, 0.35], [0, 0, 0, 1.0]])
POSES = 31
PAPER = Variant(springs="bearing")
"""The paper's 18 springs, whatever is chosen by default."""
PARTS = (
    ("the search for mistakes, once", splits, "find_mistakes"),
    ("the ladder of springs, once", cross_validation, "climbed_ladder"),
    ("`scipy.optimize.nnls` of all fits", _least_squares, "nnls"),
)
"""What it spends its time in: a name, and the function that does it."""


def measured() -> tuple[Robot, Readings]:
    """Return a KUKA arm and its readings at 31 poses under five load cases."""
    urdf = with_tool(catalogue.urdf("KR 120 R2700 extra HA"), "flange", "tcp", TOOL)
    robot, linkage = Robot.from_urdf(urdf, "tcp"), Linkage.from_urdf(urdf, "tcp")
    rng = np.random.default_rng(0)
    pressed = press_poses(linkage, POSES, rng)
    forces = press_forces(pressed.T_base_tcp)
    data = measure(bearing_truth(linkage), pressed.joints, forces, SHOP_FLOOR, rng)
    return robot, data.readings(robot.joint_names)


def learning_curve_seconds(robot: Robot, readings: Readings, data: CodecData) -> float | None:
    """Return the time of scikit-learn on the codec's own splits, or None without it."""
    if importlib.util.find_spec("sklearn") is None:
        return None
    from sklearn.linear_model import LinearRegression
    from sklearn.model_selection import learning_curve

    problem = build(ElasticModel(robot, layout(robot, "bearing")), readings)
    rows = np.arange(problem.d.size).reshape(POSES, -1)
    splits = [
        (rows[chosen[-1]].ravel(), rows[held_out].ravel())
        for chosen, held_out in zip(data.chosen[0], data.verification, strict=True)
    ]
    model = LinearRegression(positive=True, fit_intercept=False)
    sizes = rows.shape[1] * data.n_train
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return seconds(
            lambda: learning_curve(
                model,
                problem.O.reshape(-1, problem.columns),
                problem.d.ravel(),
                train_sizes=sizes,
                cv=splits,
            ),
            3,
        )


def main() -> None:
    """Measure and print."""
    robot, readings = measured()
    data = cross_validate(robot, readings, [PAPER])
    fits = data.error_mean[..., 0].size
    taken = seconds(lambda: cross_validate(robot, readings, [PAPER]), 7)
    usual = learning_curve_seconds(robot, readings, data)
    if usual is None:
        print("scikit-learn's learning_curve: left out, scikit-learn is not installed")
    reference = None if usual is None else ("scikit-learn's learning_curve", usual)
    figure(f"codec of {fits} fits: COVER, 18 springs, one process", taken, reference, aim=0.06)
    whole = ("the codec with COVER", taken)
    for part, owner, function in PARTS:
        spent = inside(lambda: cross_validate(robot, readings, [PAPER]), owner, function)
        figure(f"codec of {fits} fits: {part}", spent, whole)
    ioops = [Variant(search="ioops", springs="bearing")]
    for jobs in (1, core_count()):
        each = seconds(lambda jobs=jobs: cross_validate(robot, readings, ioops, jobs=jobs), 3)
        name, aim = f"the same with IOOPS, processes: {jobs}", 0.6 if jobs == 1 else None
        figure(name, each, whole, aim=aim)
        if jobs == 1:
            spent = inside(
                lambda: cross_validate(robot, readings, ioops, jobs=1),
                cross_validation,
                "growing_choices",
            )
            figure("the same with IOOPS: its searches", spent, ("the codec with IOOPS", each))


if __name__ == "__main__":
    main()
