"""The way off the surface, looked at every 2 mm."""

import numpy as np
import pytest

from elastocal.cell import load_cell
from elastocal.cell.examples import write_example
from elastocal.planning import cell_surface, collision_scene
from elastocal.planning.motion import clear_retreats, mover_for
from elastocal.planning.pool import PoolBuilder
from elastocal.planning.postures import retreat_joints
from elastocal.planning.surface import sample_uniform


def planned(folder, *changes):
    path, *_ = write_example(folder, "afp", force=True)
    text = path.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    cell = load_cell(path)
    return cell, cell_surface(cell)


@pytest.fixture(scope="module")
def postures(tmp_path_factory):
    cell, surface = planned(tmp_path_factory.mktemp("afp"))
    workshop = PoolBuilder.of(cell, surface)
    points = sample_uniform(surface, 40, np.random.default_rng(0))
    return workshop.pool(workshop.rank(points), points).postures.take(np.arange(8))


def clear(cell, surface, postures):
    return clear_retreats(cell, mover_for(cell, collision_scene(cell, surface)), postures)


@pytest.mark.slow
def test_postures_of_the_pool_retreat_freely(tmp_path, postures):
    assert np.all(clear(*planned(tmp_path), postures))


def test_a_fixture_in_the_way_is_found(tmp_path, postures):
    """A post that the head backs into: behind it by half the way off the surface."""
    pose = postures.take([0])
    x, y, z = pose.contact[0] + (0.45 + 0.05) * pose.normal[0] + 0.25 * pose.T_base_tcp[0, :3, 0]
    post = (
        '  - {name: post, box: {size: ["60 mm", "60 mm", "60 mm"]},'
        f' pose: {{xyz: ["{x:.5f} m", "{y:.5f} m", "{z:.5f} m"]}}}}\n  - {{name: floor'
    )
    cell, surface = planned(tmp_path, ("  - {name: floor", post))
    scene = collision_scene(cell, surface)
    blocked = not clear(cell, surface, pose)[0]
    assert blocked == any(
        scene.distances(retreat_joints(cell.robot, pose, part))[:, away(scene)].min() < 5e-3
        for part in np.linspace(0.0, 1.0, 21)
    )


def away(scene):
    """Return the pairs that must stay apart in contact too."""
    return ~scene._tool_on_touched


def test_a_tool_that_drags_over_the_surface_is_found(tmp_path, postures):
    """The head reaches 30 mm beyond the tcp plane: deep in the dome when the tcp touches."""
    deep = ('pose: {xyz: ["0 mm", "0 mm", "190 mm"]}', 'pose: {xyz: ["0 mm", "0 mm", "350 mm"]}')
    cell, surface = planned(tmp_path, deep)
    assert not np.any(clear(cell, surface, postures))
