"""Plans of the example cells: what they promise, recomputed from the plan file alone.

Checks are asked anew, by other means than the planner's where there are some: joints and frames
through Pinocchio on the URDF that the plan carries, distances and rays by trimesh, torques by
virtual work.
"""

import itertools
import json
from dataclasses import dataclass
from functools import cache

import numpy as np
import pinocchio as pin
import pytest
import trimesh

from elastocal.cell import TOOLING, load_cell
from elastocal.cell.examples import write_example
from elastocal.planning import cell_surface, collision_scene, read_plan, read_pool
from support.cli import elastocal

POOL = 600


@dataclass(frozen=True, eq=False)
class Case:
    cell: object
    plan: object
    pool: object
    raw: dict
    mesh: trimesh.Trimesh
    model: pin.Model

    def frame(self, joints):
        """Return the tcp frame by Pinocchio, from the plan's own URDF."""
        data = self.model.createData()
        q = np.zeros(self.model.nq)
        for name, value in zip(self.raw["robot"]["joints"], joints, strict=True):
            q[self.model.joints[self.model.getJointId(name)].idx_q] = value
        pin.framesForwardKinematics(self.model, data, q)
        base = data.oMf[self.model.getFrameId(self.raw["robot"]["base"])].homogeneous
        tcp = data.oMf[self.model.getFrameId(self.raw["robot"]["tcp"])].homogeneous
        return np.linalg.inv(base) @ tcp


@cache
def case(like, folder):
    path, *_ = write_example(folder, like)
    path.write_text(path.read_text().replace("pool: 3000", f"pool: {POOL}"))
    result = elastocal("plan", path, "--out", folder / "plan")
    assert result.code == 0, result.err
    cell = load_cell(path)
    surface = cell_surface(cell)
    raw = json.loads((folder / "plan" / "plan.json").read_text())
    return Case(
        cell,
        read_plan(folder / "plan"),
        read_pool(folder / "plan"),
        raw,
        trimesh.Trimesh(surface.mesh.vertices, surface.mesh.faces, process=False),
        pin.buildModelFromXML(raw["robot"]["urdf"]),
    )


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    return {like: tmp_path_factory.mktemp(like) for like in ("afp", "machining")}


@pytest.fixture(params=["afp", "machining"])
def planned(request, folders):
    return case(request.param, folders[request.param])


@pytest.mark.slow
def test_the_robot_touches_where_the_plan_says(planned):
    for pose in planned.raw["poses"]:
        T = planned.frame(pose["joints"])
        np.testing.assert_allclose(T[:3, 3], pose["tcp_position"], atol=1e-8)
        np.testing.assert_allclose(T[:3, 2], -np.array(pose["normal"]), atol=1e-8)


def test_the_approach_pose_is_off_along_the_normal(planned):
    distance = planned.raw["contact"]["approach_distance"]
    for pose in planned.raw["poses"]:
        off = planned.frame(pose["approach_joints"])[:3, 3] - np.array(pose["tcp_position"])
        np.testing.assert_allclose(off, distance * np.array(pose["normal"]), atol=1e-8)


def test_every_point_lies_on_the_mesh(planned):
    points = np.array([pose["tcp_position"] for pose in planned.raw["poses"]])
    _, distance, face = trimesh.proximity.closest_point_naive(planned.mesh, points)
    assert distance.max() < 1e-6
    tolerance = planned.cell.file.engagement.normal_tolerance
    normals = np.array([pose["normal"] for pose in planned.raw["poses"]])
    cosine = np.sum(normals * planned.mesh.face_normals[face], axis=1)
    assert np.degrees(np.arccos(cosine.clip(-1, 1))).max() < np.degrees(tolerance) + 2.0


def test_the_whole_disk_lies_on_the_surface(planned):
    radius = planned.cell.file.engagement.disk_radius
    turns = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    for pose in planned.raw["poses"]:
        T = planned.frame(pose["joints"])
        rim = T[:3, 3] + radius * (
            np.cos(turns)[:, None] * T[:3, 0] + np.sin(turns)[:, None] * T[:3, 1]
        )
        _, distance, _ = trimesh.proximity.closest_point_naive(planned.mesh, rim)
        assert distance.max() < 0.1 * radius


def test_joints_keep_their_margin_in_contact_and_approaching(planned):
    limits, margin = planned.cell.robot.limits, planned.cell.joint_margin
    for pose in planned.raw["poses"]:
        for joints in (pose["joints"], pose["approach_joints"]):
            assert np.all(np.array(joints) >= limits.lower + margin - 1e-12)
            assert np.all(np.array(joints) <= limits.upper - margin + 1e-12)


def test_loads_stay_within_friction_and_torques(planned):
    file = planned.cell.file
    forces = np.array(list(planned.raw["contact"]["load_cases"].values()))
    assert np.all(forces[:, 2] < 0.0)
    lateral = np.linalg.norm(forces[:, :2], axis=1)
    allowed = file.load_cases.friction * -forces[:, 2] / file.load_cases.safety
    assert np.all(lateral <= allowed)
    for pose in planned.raw["poses"]:
        assert np.all(np.abs(torques(planned, pose, forces)) <= limits_of(planned))


def limits_of(planned):
    allowed = planned.cell.torque_limits
    return np.where(np.isnan(allowed), np.inf, allowed)


def torques(planned, pose, forces):
    """Return what actuators supply, as the change of the work of weights and load, (case, joint).

    Derivatives of heights and of the tool point by central differences, no Jacobian.
    """
    q = np.array(pose["joints"])
    step = 1e-6
    weight = planned.cell.file.tool.mass * planned.cell.gravity_base
    R = planned.frame(q)[:3, :3]
    result = np.zeros((len(forces), len(q)))
    for joint in range(len(q)):
        ahead, behind = q.copy(), q.copy()
        ahead[joint] += step
        behind[joint] -= step
        tip, centre, energy = (
            (a - b) / (2.0 * step)
            for a, b in zip(state(planned, ahead), state(planned, behind), strict=True)
        )
        result[:, joint] = energy - centre @ weight - (forces @ R.T) @ tip
    return result


def state(planned, q):
    """Return tcp, centre of mass of the tool, and potential energy of the arm's links."""
    T = planned.frame(q)
    centre = T[:3, :3] @ planned.cell.tool_centre_tcp + T[:3, 3]
    model = planned.model.copy()
    model.gravity.linear = planned.cell.gravity_base
    data = model.createData()
    full = np.zeros(model.nq)
    for name, value in zip(planned.raw["robot"]["joints"], q, strict=True):
        full[model.joints[model.getJointId(name)].idx_q] = value
    return T[:3, 3], centre, pin.computePotentialEnergy(model, data, full)


def test_nothing_collides_on_the_way_to_the_surface_and_back(planned):
    scene = collision_scene(planned.cell, cell_surface(planned.cell))
    clearance = planned.cell.file.limits.clearance
    names = [
        [scene._geometry.geometryObjects[i].name for i in (pair.first, pair.second)]
        for pair in scene._geometry.collisionPairs
    ]
    tools = {body.name for body in scene.tool}
    pressed = np.array([TOOLING in pair and bool(tools & set(pair)) for pair in names])
    for pose in planned.plan.poses:
        here, there = np.array(pose.joints), np.array(pose.approach_joints)
        way = here + np.linspace(0.0, 1.0, 6)[:, None] * (there - here)
        distance = scene.distances(way)
        assert distance[:, ~pressed].min() >= clearance
        assert distance[2:].min() >= clearance


@pytest.mark.slow
def test_moves_between_poses_keep_clear(planned):
    scene = collision_scene(planned.cell, cell_surface(planned.cell))
    stops = {None: np.array(planned.plan.robot.home)}
    stops |= {pose.id: np.array(pose.approach_joints) for pose in planned.plan.poses}
    for move in planned.plan.moves:
        corners = [stops[move.start], *map(np.array, move.via), stops[move.end]]
        for a, b in itertools.pairwise(corners):
            way = a + np.linspace(0.0, 1.0, 9)[:, None] * (b - a)
            assert scene.distances(way).min() >= planned.cell.file.limits.clearance - 1e-9
            assert np.all(scene.keeps(way, planned.cell.file.limits.clearance))


def test_the_station_named_sees_the_marker(planned):
    marker, stations = planned.cell.file.marker, planned.cell.file.trackers
    where = {tracker.name: tracker for tracker in stations}
    for pose in planned.raw["poses"]:
        tracker = where[pose["seen_by"]]
        T = planned.frame(pose["joints"])
        point = T[:3, :3] @ marker.position_tcp + T[:3, 3]
        beam = tracker.position_base - point
        length = np.linalg.norm(beam)
        assert tracker.range[0] <= length <= tracker.range[1]
        angle = np.arccos(beam @ T[:3, :3] @ marker.axis_tcp / length)
        assert angle < marker.acceptance
        hits, *_ = planned.mesh.ray.intersects_location(
            [point + 1e-3 * beam / length], [beam], multiple_hits=False
        )
        assert len(hits) == 0


def test_margins_in_the_plan_are_positive_and_those_of_the_pool(planned):
    names = {check["name"] for check in planned.raw["pool"]["checks"]} - {"reach"}
    for pose in planned.raw["poses"]:
        assert set(pose["margins"]) == names
        assert min(pose["margins"].values()) > 0.0
        column = planned.pool.margin[:, pose["candidate"]]
        for name, margin in zip(planned.pool.check_names, column, strict=True):
            assert pose["margins"][name] == pytest.approx(margin)


def test_the_search_order_lists_every_pose_once(planned):
    search = planned.raw["search"]
    assert sorted(search["order"]) == [pose["id"] for pose in planned.raw["poses"]]
    contact = np.array([pose["tcp_position"] for pose in planned.raw["poses"]])
    gaps = np.linalg.norm(planned.pool.contact[:, None] - contact, axis=2)
    assert gaps.min(axis=1).max() == pytest.approx(search["covering_radius"], abs=1e-6)


def test_moves_lead_from_home_through_all_poses_and_back(planned):
    ends = [(move["start"], move["end"]) for move in planned.raw["moves"]]
    stops = [None, *(pose["id"] for pose in planned.raw["poses"]), None]
    assert ends == list(itertools.pairwise(stops))
    assert all(move["duration"] > 0.0 for move in planned.raw["moves"])


def test_afp_covers_within_175_mm(folders):
    search = case("afp", folders["afp"]).raw["search"]
    assert search["covered"] is True
    assert search["covering_radius"] <= 0.175


def test_machining_presses_15_poses_on_four_faces_or_more(folders):
    poses = case("machining", folders["machining"]).raw["poses"]
    assert len(poses) == 15
    assert len({tuple(np.round(pose["normal"]).astype(int)) for pose in poses}) >= 4
    assert {pose["seen_by"] for pose in poses} <= {"station_1", "station_2"}


def test_ioops_crowds_at_the_edges_and_cover_does_not(folders):
    """The finding of the paper's Fig. 3, as numbers."""
    raw = case("afp", folders["afp"]).raw
    cover, ioops = raw["search"]["spread"], raw["comparison"]["spread"]
    assert raw["comparison"]["name"] == "ioops"
    assert ioops["boundary_distance"] < 0.5 * cover["boundary_distance"]
    assert ioops["nearest_neighbour"] < 0.5 * cover["nearest_neighbour"]
    assert ioops["o1"] > cover["o1"]
    assert ioops["covering_radius"] > 1.5 * cover["covering_radius"]


@pytest.mark.slow
def test_the_same_cell_gives_the_same_plan(folders, tmp_path):
    folder = folders["afp"]
    case("afp", folder)
    assert elastocal("plan", folder / "cell.yaml", "--out", tmp_path / "again").code == 0
    for name in ("plan.json", "plan.csv", "calib.src", "calib.dat", "plan.svg"):
        assert (tmp_path / "again" / name).read_bytes() == (folder / "plan" / name).read_bytes()
