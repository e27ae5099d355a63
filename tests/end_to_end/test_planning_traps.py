"""What users give the planner by mistake: each is refused in one line, or works and is named."""

import json

import numpy as np
import pytest
import trimesh

from elastocal.cell.examples import write_example
from support.cli import elastocal

FEW = ("pool: 3000", "pool: 100")


def cell(folder, *changes, like="afp"):
    """Write an example with some of its text replaced."""
    path, mesh = write_example(folder, like, force=True)
    text = path.read_text()
    for old, new in (FEW, *changes):
        assert old in text, old
        text = text.replace(old, new)
    path.write_text(text)
    return path, mesh


def refusal(folder, *changes, like="afp"):
    path, _ = cell(folder, *changes, like=like)
    result = elastocal("plan", path, "--out", folder / "plan")
    assert not (folder / "plan").exists()
    return result.reason


def reshaped(folder, change, *changes):
    """Plan on the dome with its mesh changed; return the result."""
    path, mesh = cell(folder, *changes)
    dome = trimesh.load_mesh(mesh)
    change(dome).export(mesh)
    return elastocal("plan", path, "--out", folder / "plan")


def findings(folder):
    found = json.loads((folder / "plan" / "plan.json").read_text())["findings"]
    return [each["text"] for each in found]


@pytest.mark.slow
def test_an_open_mesh_works_and_says_so(tmp_path):
    path, _ = cell(tmp_path)
    result = elastocal("plan", path, "--out", tmp_path / "plan")
    assert result.code == 0, result.err
    assert any("open mesh" in finding for finding in findings(tmp_path))
    assert "open mesh" in " ".join(result.err.split())


@pytest.mark.slow
def test_a_mesh_that_is_no_manifold_works_and_says_so(tmp_path):
    def with_fin(dome):
        a, b, _ = dome.faces[len(dome.faces) // 2]
        tip = dome.vertices[a] + [0.0, 0.0, 30.0]
        fin = [[a, b, len(dome.vertices)]]
        vertices = np.vstack([dome.vertices, tip])
        return trimesh.Trimesh(vertices, np.vstack([dome.faces, fin]), process=False)

    result = reshaped(tmp_path, with_fin)
    assert result.code == 0, result.err
    assert any("not a manifold" in finding for finding in findings(tmp_path))


@pytest.mark.slow
def test_inverted_normals_are_found_and_said(tmp_path):
    def inverted(dome):
        dome.invert()
        return dome

    reason = reshaped(tmp_path, inverted).reason
    assert "the normals point away from the robot's side" in reason
    assert "flip_normals: true" in reason


@pytest.mark.slow
def test_inverted_normals_are_mended_by_the_cell_file(tmp_path):
    def inverted(dome):
        dome.invert()
        return dome

    mended = ("  # flip_normals: true ", "  flip_normals: true  # ")
    assert reshaped(tmp_path, inverted, mended).code == 0


def test_a_mesh_in_mm_read_as_m_is_found_by_its_distance(tmp_path):
    reason = refusal(tmp_path, ("unit: mm", "unit: m"))
    assert "is the mesh in mm and read as m" in reason


def test_a_mesh_in_m_read_as_mm_is_found_by_its_size(tmp_path):
    def small(dome):
        dome.apply_scale(1e-3)
        return dome

    reason = reshaped(tmp_path, small).reason
    assert "is the mesh in m and read as mm" in reason


def test_a_surface_out_of_reach_names_what_to_move(tmp_path):
    reason = refusal(tmp_path, ('xyz: ["1.85 m", "0 m", "1.0 m"]', 'xyz: ["7 m", "0 m", "1.0 m"]'))
    assert "0 of" in reason
    assert "reach" in reason
    assert "bring the tooling within the robot's reach" in reason


def test_an_empty_region_says_where_the_surface_is(tmp_path):
    region = 'region: {box: {min: ["5 m", "5 m", "5 m"], max: ["6 m", "6 m", "6 m"]}}'
    line = '# region: {box: {min: ["-0.5 m", "-0.5 m", "-1 m"], max: ["0.5 m", "0.5 m", "1 m"]}}'
    reason = refusal(tmp_path, (line, region))
    assert "the region holds none of" in reason
    assert "extends from" in reason


def test_more_poses_than_the_pool_has_are_refused_by_the_cell_file(tmp_path):
    reason = refusal(tmp_path, ("# poses: 31 ", "poses: 101 # "))
    assert "search.pool: " in reason
    assert "must be at least the 101 poses" in reason


@pytest.mark.slow
def test_more_poses_than_the_valid_candidates_are_refused(tmp_path):
    reason = refusal(
        tmp_path,
        ("# poses: 31 ", "poses: 100 # "),
        ('  d_max: "175 mm"', '  # d_max: "175 mm"'),
        ('joint_margin: "5 deg"', 'joint_margin: "64 deg"'),
    )
    assert "points on the surface can be pressed on, and 100 poses are wanted" in reason
    assert "joint_limits" in reason


@pytest.mark.parametrize("d_max", ["0 mm", "-175 mm"])
def test_a_cover_distance_that_is_not_positive_is_refused(tmp_path, d_max):
    reason = refusal(tmp_path, ('d_max: "175 mm"', f'd_max: "{d_max}"'))
    assert "search.d_max" in reason


def test_no_friction_is_refused(tmp_path):
    reason = refusal(tmp_path, ("friction: 0.5 ", "friction: 0.0 "))
    assert "load_cases.friction" in reason


def test_too_little_friction_for_the_loads_is_refused_by_name(tmp_path):
    reason = refusal(tmp_path, ("friction: 0.5 ", "friction: 0.2 "))
    assert "friction" in reason


@pytest.mark.slow
def test_loads_beyond_the_torques_name_the_torque(tmp_path):
    reason = refusal(
        tmp_path,
        ('fz: "1100 N"', 'fz: "20 kN"'),
        ('force_range: ["2500 N", "2500 N", "6250 N"]', 'force_range: ["9 kN", "9 kN", "30 kN"]'),
        ('["400 N*m", "400 N*m", "400 N*m"]', '["9 kN*m", "9 kN*m", "9 kN*m"]'),
        ("pool: 100", "pool: 31"),
    )
    assert "refused by" in reason
    assert "torque" in reason
    assert "lower the forces" in reason


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ('joint_margin: "5 deg"', 'joint_margin: "170 deg"', "limits.joint_margin"),
        ('travel: ["-1.5 m", "1.5 m"]', 'travel: ["1.5 m", "-1.5 m"]', "robot.rail.travel"),
        ('range: ["1.0 m", "15 m"]', 'range: ["15 m", "1.0 m"]', "trackers.0.range"),
        ('approach_distance: "100 mm"', 'approach_distance: "2 mm"', "approach_distance"),
        ('rail_margin: "0 mm"', 'rail_margin: "1.6 m"', "limits.rail_margin"),
    ],
)
def test_limits_that_contradict_themselves_are_refused_by_name(tmp_path, old, new, named):
    assert named in refusal(tmp_path, (old, new))


@pytest.mark.parametrize("content", [b"", b"solid dome\n facet", b"\x00" * 200])
def test_an_unreadable_mesh_is_refused_by_name(tmp_path, content):
    path, mesh = cell(tmp_path)
    mesh.write_bytes(content)
    reason = elastocal("plan", path, "--out", tmp_path / "plan").reason
    assert "dome.stl" in reason


def test_a_missing_mesh_is_refused_by_name(tmp_path):
    path, mesh = cell(tmp_path)
    mesh.unlink()
    assert "dome.stl" in elastocal("plan", path, "--out", tmp_path / "plan").reason


def test_an_unknown_technique_is_refused_before_the_long_work(tmp_path):
    reason = refusal(tmp_path, ("technique: cover", "technique: covr"))
    assert "unknown search technique 'covr'" in reason
    assert "did you mean 'cover'" in reason


def test_an_accuracy_without_a_process_says_what_it_needs(tmp_path):
    reason = refusal(tmp_path, ("technique: cover", 'accuracy: "0.05 mm"'))
    assert "process.file" in reason


@pytest.mark.slow
def test_a_folder_that_holds_files_is_left_alone(tmp_path):
    path, _ = cell(tmp_path)
    (tmp_path / "plan").mkdir()
    (tmp_path / "plan" / "mine.txt").write_text("keep")
    result = elastocal("plan", path, "--out", tmp_path / "plan")
    assert "holds files already" in result.reason
    assert elastocal("plan", path, "--out", tmp_path / "plan", "--force").code == 0
    assert (tmp_path / "plan" / "mine.txt").read_text() == "keep"


def test_ctrl_c_leaves_nothing_behind(tmp_path, monkeypatch):
    from elastocal.planning import plan

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(plan, "plan_route", interrupted)
    path, _ = cell(tmp_path)
    before = sorted(entry.name for entry in tmp_path.iterdir())
    result = elastocal("plan", path, "--out", tmp_path / "plan")
    assert result.code == 130
    assert sorted(entry.name for entry in tmp_path.iterdir()) == before


def test_a_name_that_no_controller_takes_is_refused(tmp_path):
    path, _ = cell(tmp_path)
    result = elastocal("plan", path, "--out", tmp_path / "plan", "--program", "my plan")
    assert "my plan" in result.reason
    assert not (tmp_path / "plan").exists()


def test_a_home_in_collision_is_refused_before_the_long_work_and_names_the_bodies(tmp_path):
    box = (
        '  - {name: post, box: {size: ["0.3 m", "0.3 m", "3 m"]},'
        ' pose: {xyz: ["1.4 m", "0 m", "1.5 m"]}}\n'
    )
    reason = refusal(tmp_path, ("  - {name: floor", f"{box}  - {{name: floor"))
    assert "HOME is not free of collision" in reason
    assert "post" in reason


@pytest.mark.slow
def test_a_tool_longer_than_its_stem_is_refused_by_collision(tmp_path):
    deep = ('pose: {xyz: ["0 mm", "0 mm", "190 mm"]}', 'pose: {xyz: ["0 mm", "0 mm", "350 mm"]}')
    few = ("pool: 100", "pool: 31")
    assert "collision" in refusal(tmp_path, deep, few)


@pytest.mark.slow
def test_what_the_catalogue_assumes_is_said(tmp_path):
    path, _ = cell(tmp_path, like="machining")
    assert elastocal("plan", path, "--out", tmp_path / "plan").code == 0
    assumed = [finding for finding in findings(tmp_path) if finding.startswith("assumed, ")]
    assert any("taken from KR 210 R3100 ultra" in finding for finding in assumed)
