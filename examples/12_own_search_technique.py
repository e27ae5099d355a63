"""A search technique of your own, judged beside COVER and a random choice.

You learn what the protocol of a search technique asks for, how to make it known by name, and how
the cross-validation of Algorithm 1 compares it with others on the same splits. COVER makes the
*largest* distance of a candidate from its nearest chosen pose small; the technique here the mean.
"""

import numpy as np

from elastocal.codec import CodecOptions, cross_validate, judge, make_variants
from elastocal.planning.search import TECHNIQUES, Candidates, Selection, check_count
from elastocal.robot import Robot, T_from_xyzabc, catalogue, with_tool
from elastocal.sim.arm import (
    LINK_BENDING,
    SHOP_FLOOR,
    Linkage,
    bearing_truth,
    measure,
    press_forces,
    press_poses,
    with_link_bending,
    with_stiffening_gears,
)


class Median:
    """Add the pose that lowers the mean distance of the pool from its nearest chosen pose most."""

    name = "median"
    nested = True  # the choice of n poses begins with that of n - 1

    def search(
        self,
        candidates: Candidates,
        count: int,
        rng: np.random.Generator | None = None,  # noqa: ARG002 - nothing is drawn
    ) -> Selection:
        """Return ``count`` candidates in the order of choice."""
        check_count(candidates, count)
        points = candidates.contact  # (pose, 3), in m
        distance = np.linalg.norm(points[:, None] - points[None], axis=2)
        nearest, order = np.full(len(points), np.inf), []
        for _ in range(count):
            mean = np.minimum(nearest, distance).mean(axis=1)
            mean[order] = np.inf  # none is chosen twice
            order.append(int(mean.argmin()))
            nearest = np.minimum(nearest, distance[order[-1]])
        return Selection(np.array(order), self.name)


TECHNIQUES.add("median", Median)

urdf = catalogue.urdf("KR 120 R2700 extra HA")
urdf = with_tool(urdf, "flange", "tcp", T_from_xyzabc(0.15, 0.0, 0.35, 0.0, 0.0, 0.0))
robot, linkage = Robot.from_urdf(urdf, "tcp"), Linkage.from_urdf(urdf, "tcp")
bending = dict.fromkeys(linkage.joint_names[1:3], LINK_BENDING)
arm = with_stiffening_gears(with_link_bending(bearing_truth(linkage), bending))
rng = np.random.default_rng(0)
pressed = press_poses(linkage, 31, rng)
data = measure(arm, pressed.joints, press_forces(pressed.T_base_tcp), SHOP_FLOOR, rng)

variants = make_variants({"search": ("cover", "median", "random")})
codec = cross_validate(robot, data.readings(robot.joint_names), variants, CodecOptions(splits=15))
print("median of the mean error at held-out poses, in µm")
print("training poses", *(f"{n:5d}" for n in codec.n_train[2::4]))
for variant in codec.variants:
    curve = 1e6 * np.median(codec.errors(variant.name), axis=0)
    print(f"{variant.name:14s}", *(f"{error:5.0f}" for error in curve[2::4]))
print()
for pair in judge(codec).pairs:
    told = (1e6 * float(each[5]) for each in (pair.difference, pair.low, pair.high))
    print("{} - {} with 6 poses: {:.0f} µm (95 %: {:.0f} to {:.0f})".format(pair.a, pair.b, *told))
