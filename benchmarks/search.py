"""Print how fast the pose searches are, each beside a reference of the same run.

Machines differ and are noisy, so the ratios are what counts; the direct form of IOOPS, which
would take minutes, is timed for one sweep over the pool and multiplied by the number of sweeps.
Run with ``python benchmarks/search.py``.
"""

import time

import numpy as np
from timing import figure, inside, seconds

from elastocal.elastic import ElasticModel, layout
from elastocal.planning.search import (
    CRITERIA,
    Candidates,
    Cover,
    ExchangeSearch,
    Information,
    build_information,
    cover,
    covering_radius,
    nearest_neighbour,
    o1,
    technique,
)
from elastocal.planning.search.cover import PlainField
from elastocal.planning.search.exchange import ExchangeSelection
from elastocal.planning.search.information import EPSILON
from elastocal.robot import Robot, catalogue, with_tool
from elastocal.sim.arm import (
    Linkage,
    press_forces,
    press_poses,
)

TOOL = np.array([[1.0, 0, 0, 0.15], [0, 1.0, 0, 0], [0, 0, 1.0, 0.35], [0, 0, 0, 1.0]])
POOL, POSES = 3000, 31
AIMS = {"i_optimal": 0.05, "exchange-a": 0.1, "exchange-e": 0.5}
"""Largest times asked for, in s, by technique."""


def pressed_pool() -> Candidates:
    """Return 3000 poses of a KUKA arm on a dome, with the rows of 18 springs and 5 load cases."""
    urdf = with_tool(catalogue.urdf("KR 120 R2700 extra HA"), "flange", "tcp", TOOL)
    robot = Robot.from_urdf(urdf, "tcp")
    pressed = press_poses(Linkage.from_urdf(urdf, "tcp"), POOL, np.random.default_rng(0))
    model = ElasticModel(robot, layout(robot, "bearing"))
    forces = press_forces(pressed.T_base_tcp)
    blocks = model.observation_blocks(pressed.joints[:, None], forces)
    rows = blocks.reshape(POOL, -1, len(model.springs))
    process = rows[::50].reshape(-1, rows.shape[2])
    return Candidates(pressed.T_base_tcp[:, :3, 3], rows, process=process)


def direct_sweep(information: Information, rows: np.ndarray, chosen: np.ndarray) -> None:
    """Find the best pose to add as Pseudocode 1 reads: the singular values of every choice."""
    prior = np.sqrt(EPSILON) * np.eye(information.rank)
    known = np.concatenate([*rows[chosen], prior])
    for pose in rows:
        np.linalg.svd(np.concatenate([known, pose]), compute_uv=False)


def triangular_sweep(information: Information, rows: np.ndarray, chosen: np.ndarray) -> None:
    """Find it with the chosen rows reduced to a triangle first: the direct form at its best."""
    prior = np.sqrt(EPSILON) * np.eye(information.rank)
    known = np.linalg.qr(np.concatenate([*rows[chosen], prior]), mode="r")
    for pose in rows:
        np.linalg.svd(np.concatenate([known, pose]), compute_uv=False)


def usual_loop(contact: np.ndarray, count: int) -> list[int]:
    """Return COVER's picks by the loop that one would write."""
    pick = int(np.linalg.norm(contact - contact.mean(axis=0), axis=1).argmin())
    near = np.full(len(contact), np.inf)
    order = []
    for _ in range(count):
        order.append(pick)
        np.minimum(near, np.linalg.norm(contact - contact[pick], axis=1), out=near)
        pick = int(near.argmax())
    return order


def plain_field(contact: np.ndarray, count: int) -> list[int]:
    """Return COVER's picks by our own field without cells."""
    field = PlainField(contact)
    pick = int(np.linalg.norm(contact - contact.mean(axis=0), axis=1).argmin())
    order = []
    for _ in range(count):
        order.append(pick)
        field.add(pick)
        pick = field.farthest().pose
    return order


def report_ioops(pool: Candidates) -> None:
    """Print IOOPS against its direct forms."""
    information = build_information(pool)
    assert pool.observation is not None
    rows = pool.observation / information.scale @ information.basis
    selection = technique("ioops").search(pool, POSES)
    assert isinstance(selection, ExchangeSelection)
    sweeps = sum(len(run.added) for run in selection.runs)
    taken = seconds(lambda: technique("ioops").search(pool, POSES), 5)
    direct = seconds(lambda: direct_sweep(information, rows, selection.order), 2)
    triangular = seconds(lambda: triangular_sweep(information, rows, selection.order), 2)
    figure(
        f"IOOPS {POOL} → {POSES}, 18 springs, {len(selection.runs)} starts",
        taken,
        (f"direct SVD, {sweeps} sweeps (one timed)", direct * sweeps),
    )
    once = ExchangeSearch("d", starts=1)
    first = once.search(pool, POSES)
    steps = len(first.runs[0].added)
    alone = seconds(lambda: once.search(pool, POSES), 5)
    print(
        f"  direct SVD: {direct:.3f} s a sweep (one timed), {direct * sweeps:.1f} s for {sweeps};"
        f" ratio {direct * sweeps / taken:.0f} ({direct * steps / alone:.0f} with one start,"
        f" {steps} sweeps, {alone:.3f} s)"
    )
    print(
        f"  SVD behind a triangle: {triangular:.3f} s a sweep, ratio"
        f" {triangular * sweeps / taken:.0f}"
    )


def report_cover_small(pool: Candidates) -> None:
    """Print COVER on a pool of the paper's size."""
    bare = Candidates(pool.contact)
    taken = seconds(lambda: Cover().search(bare, POSES), 50)
    usual = seconds(lambda: usual_loop(bare.contact, POSES), 50)
    figure(f"COVER {POOL} → {POSES}", taken, ("the usual NumPy loop", usual))


def report_cover_large() -> None:
    """Print COVER on a million candidates, by number and by distance."""
    u, v = np.random.default_rng(0).uniform(-1.0, 1.0, (2, 1_000_000))
    bare = Candidates(np.column_stack([u, v, 0.3 * np.cos(u) * np.sin(v)]))
    selection = Cover().search(bare, 500)
    taken = seconds(lambda: Cover().search(bare, 500), 3)
    d_max = float(selection.trace["covering_radius"][-1])
    by_distance = Cover(d_max=d_max).search(bare, len(bare))
    taken_d_max = seconds(lambda: Cover(d_max=d_max).search(bare, len(bare)), 3)
    start = time.perf_counter()
    order = usual_loop(bare.contact, 500)
    usual = time.perf_counter() - start
    plain = seconds(lambda: plain_field(bare.contact, 500), 1)
    same = selection.order.tolist() == order == by_distance.order.tolist()
    figure("COVER 10⁶ → 500", taken, ("the usual NumPy loop", usual), aim=0.15)
    tree = inside(lambda: Cover().search(bare, 500), cover, "cKDTree", 3)
    figure("COVER 10⁶ → 500: SciPy's k-d tree alone", tree, ("the whole search", taken))
    print(f"  until d_max = {d_max:.4f} m: {taken_d_max:.2f} s; same picks: {same}")
    print(f"  our loop without cells: {plain:.2f} s; ratio {plain / taken:.1f}")


def report_techniques(pool: Candidates) -> None:
    """Print what each technique costs and how its choice lies on the surface."""
    information, ioops = build_information(pool), 0.0
    for name in ("cover", "ioops", "i_optimal", "exchange-a", "exchange-e", "random"):
        search = technique(name)
        order = search.search(pool, POSES, np.random.default_rng(0)).order
        taken = seconds(lambda search=search: search.search(pool, POSES), 5)
        ioops = taken if name == "ioops" else ioops
        if name in AIMS:
            figure(f"{name} {POOL} → {POSES}", taken, ("IOOPS", ioops), aim=AIMS[name])
            inverses = inside(lambda search=search: search.search(pool, POSES), np.linalg, "inv")
            if inverses:
                own = f"{name} {POOL} → {POSES}: LAPACK's inverses alone"
                figure(own, inverses, ("the whole search", taken))
        variance = -float(prediction_value(information, order))
        print(
            f"{name:>11}: {1e3 * taken:7.1f} ms, O1 {o1(information, order):.3f}, prediction sigma"
            f" {np.sqrt(variance):.3f} of a reading's, covering radius"
            f" {1e3 * covering_radius(pool, order):.0f} mm, nearest neighbour"
            f" {1e3 * nearest_neighbour(pool, order).mean():.0f} mm"
        )


def prediction_value(information: Information, order: np.ndarray) -> np.ndarray:
    """Return the I-criterion of a choice."""
    return CRITERIA["i"].of(information).value(information.matrix(order))


def main() -> None:
    """Measure and print."""
    pool = pressed_pool()
    report_ioops(pool)
    report_cover_small(pool)
    report_cover_large()
    report_techniques(pool)


if __name__ == "__main__":
    main()
