"""Regions of a surface."""

import numpy as np

from elastocal.cell.hardware import RegionEntry


def test_a_polygon_may_be_concave_and_bounded_in_height():
    corners = [["0 m", "0 m"], ["2 m", "0 m"], ["2 m", "2 m"], ["1 m", "1 m"], ["0 m", "2 m"]]
    region = RegionEntry.model_validate(
        {"polygon": {"corners": corners, "height": ["-1 m", "1 m"]}}
    )
    points = [[0.5, 0.5, 0], [1, 1.5, 0], [1.9, 1.7, 0], [0.5, 0.5, 2], [-0.1, 1, 0], [1, 0.9, 0]]
    np.testing.assert_array_equal(
        region.contains(np.array(points)), [True, False, True, False, False, True]
    )


def test_a_region_may_be_turned():
    box = {"min": ["0 m", "0 m", "0 m"], "max": ["1 m", "1 m", "1 m"]}
    pose = {"xyz": ["10 m", "0 m", "0 m"], "abc": ["90 deg", "0 deg", "0 deg"]}
    region = RegionEntry.model_validate({"box": box, "pose": pose})
    inside = region.contains(np.array([[9.5, 0.5, 0.5], [10.5, 0.5, 0.5]]))
    np.testing.assert_array_equal(inside, [True, False])
