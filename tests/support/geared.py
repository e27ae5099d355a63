"""An arm whose gears bear its own weight and remember friction."""

from dataclasses import replace
from functools import cache

import numpy as np

from elastocal.elastic import ElasticModel, Gear, bearing
from elastocal.identification import CalibratedModel, Observability
from elastocal.robot import Robot
from support.cells import urdf

MASSES = (280.0, 190.0, 150.0, 60.0, 25.0, 40.0)
SLIPS = (40.0, 150.0)


@cache
def heavy_robot(gravity: tuple[float, float, float] | None = None) -> Robot:
    """Return the arm of `support.cells` with masses, each beside its joint's axis."""
    text = urdf()
    for k, mass in enumerate(MASSES, start=1):
        bare = f'<link name="link_{k}"/>'
        assert text.count(bare) == 1
        inertial = (
            f'<inertial><origin xyz="0.1 -0.05 {0.3 if k < 4 else 0.1}"/><mass value="{mass}"/>'
            '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        )
        text = text.replace(bare, f'<link name="link_{k}">{inertial}</link>')
    made = Robot.from_urdf(text, "tcp")
    return made if gravity is None else replace(made, gravity=gravity)


@cache
def geared(gravity: tuple[float, float, float] | None = None) -> CalibratedModel:
    """Return the bearing layout with a gear at every joint, and made-up parameters."""
    robot = heavy_robot(gravity)
    springs = list(bearing(robot))
    for k, spring in enumerate(springs[:6]):
        springs[k] = Gear(
            spring.name, spring.joint, spring.axes[0].axis, knees=(300.0, 2000.0), slips=SLIPS
        )
    model = ElasticModel(robot, springs)
    n, rng = len(model.parameters), np.random.default_rng(3)
    c = rng.uniform(2e-8, 1e-7, n)
    draws = c * (1.0 + 0.1 * rng.normal(size=(60, n)))
    return CalibratedModel(model, c, draws, Observability(n, 1.0, (True,) * n, ()), "made up")
