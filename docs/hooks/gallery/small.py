"""Small figures: the k-centre problem (paper Fig. 4), streams of one pose (Procedure 1), logs."""

import shutil
from functools import partial
from itertools import combinations
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from elastocal.cell import Cell
from elastocal.planning import make_plan
from elastocal.planning.search import Candidates, Cover
from elastocal.procedure import (
    Event,
    Journal,
    PoseLog,
    RunFolder,
    Runner,
    RunRecord,
    Session,
    SessionHooks,
    read_streams,
    run_settings,
)
from elastocal.procedure.record import PoseRecorder, Streams, read_commits
from elastocal.report.plots import new_figure, style, write_figure, write_timeline_figure
from elastocal.sim.workcell import simulated_devices
from elastocal.workflows import import_logs
from gallery.campaign import example_cell

POINTS, CENTRES = 60, 4
FEW_POSES = {"pool: 3000": "pool: 40", 'd_max: "175 mm"': "poses: 5"}
CLOCKS = {"force.csv": 3.2, "tracker.csv": -41.7}
"""What the clocks of two logs are behind the controller's, in s."""


def make(folder: Path) -> dict[str, str]:
    """Make the figures; return what is told of each."""
    return _k_centre(folder) | _streams(folder)


def _k_centre(folder: Path) -> dict[str, str]:
    """Set the choice of COVER beside the best choice there is."""
    points = np.random.default_rng(7).uniform(0.0, 1.0, (POINTS, 2)) * (1.4, 1.0)
    pool = Candidates(np.column_stack([points, np.zeros(POINTS)]))
    cover = Cover().search(pool, CENTRES)
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    choices = np.array(list(combinations(range(POINTS), CENTRES)))
    radius = distance[choices].min(axis=1).max(axis=1)
    best = int(radius.argmin())
    found = {
        "COVER": (cover.order, cover.covering_radius),
        f"Best of {len(choices)} choices": (choices[best], float(radius[best])),
    }
    write_figure(folder / "k-centre.svg", partial(_draw_k_centre, points, found))
    ratio = cover.covering_radius / float(radius[best])
    return {
        "k-centre": f"{POINTS} points, {CENTRES} centres, no unit, nothing is fitted. The distance"
        f" of COVER is {ratio:.2f} times the best one; never over 2 times"
    }


def _draw_k_centre(points: np.ndarray, found: dict[str, tuple[np.ndarray, float]]) -> Figure:
    figure = new_figure(9.0, 3.6)
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes, (name, (chosen, radius)) in zip(panels, found.items(), strict=True):
        axes.scatter(*points.T, s=18, c=style.SKY, lw=0)
        axes.scatter(*points[chosen].T, s=45, c=style.INK, lw=0, zorder=3)
        for centre in points[chosen]:
            axes.add_patch(Circle(centre, radius, fill=False, color=style.VERMILLION, lw=1.0))
            axes.update_datalim([centre - radius, centre + radius])
        axes.set_title(f"{name}: largest distance {radius:.3f}")
        axes.autoscale_view()
        axes.set_aspect("equal")
        axes.set_axis_off()
    figure.subplots_adjust(left=0.01, right=0.99, top=0.9, bottom=0.01, wspace=0.02)
    return figure


def _streams(folder: Path) -> dict[str, str]:
    """Visit some poses of the simulated cell; draw what was recorded, and the same from logs."""
    cell = example_cell(folder / "cell", "afp", FEW_POSES)
    visits = _visit(cell, RunFolder(folder / "run"))
    streams, commit = visits[0]
    write_figure(folder / "pose-streams.svg", partial(_draw_streams, cell, streams, commit))
    logs = _write_logs(folder / "run", [each for each, _ in visits])
    found = import_logs(logs, map=_write_map(folder / "run", cell)).found
    title = f"Merged logs: {', '.join(log.name for log in logs)}"
    write_timeline_figure(folder / "merged-logs.png", found, title)
    shutil.rmtree(folder / "cell")
    shutil.rmtree(folder / "run")
    seconds = streams.arm.time[-1] - streams.arm.time[0]
    samples, points = len(streams.wrench.time), len(streams.points.time)
    used = [each for each in found.plateaus if each.pose >= 0]
    return {
        "pose-streams": f"Force in N, displacement in mm over {seconds:.0f} s of the cell's time:"
        f" {samples} samples of the sensor, {points} of the tracker, raw; nothing is fitted",
        "merged-logs": f"Force in N, displacement in mm: {len(used)} plateaus at"
        f" {len({each.pose for each in used})} poses, found in {len(logs)} logs with clocks of"
        " their own; nothing is fitted but the clocks",
    }


def _write_logs(folder: Path, visits: list[Streams]) -> list[Path]:
    """Write what the devices said as three logs, each by its own clock."""
    arm = [np.column_stack([each.arm.time, each.arm.q]) for each in visits]
    wrench = [np.column_stack([s.wrench.time, s.wrench.force, s.wrench.moment]) for s in visits]
    points = [np.column_stack([each.points.time, each.points.position]) for each in visits]
    tables = {
        "controller.csv": (["t", *visits[0].joint_names], arm),
        "force.csv": (["t", "fx", "fy", "fz", "mx", "my", "mz"], wrench),
        "tracker.csv": (["t", "x", "y", "z"], points),
    }
    for name, (header, rows) in tables.items():
        table = np.vstack(rows)
        table[:, 0] -= CLOCKS.get(name, 0.0)
        np.savetxt(folder / name, table, "%.9g", ",", header=",".join(header), comments="")
    return [folder / name for name in tables]


def _write_map(folder: Path, cell: Cell) -> Path:
    joints = ", ".join(cell.robot.joint_names[1:])
    path = folder / "map.yaml"
    path.write_text(
        f"""\
schema: elastocal.log-map/1
cell: {cell.path}
logs:
  - log: controller.csv
    time: {{column: t, unit: s}}
    joints: [{{columns: [rail], unit: m}}, {{columns: [{joints}], unit: rad}}]
  - log: force.csv
    time: {{column: t, unit: s}}
    force: {{columns: [fx, fy, fz], unit: N}}
    moment: {{columns: [mx, my, mz], unit: N*m}}
  - log: tracker.csv
    time: {{column: t, unit: s}}
    markers: [{{columns: [x, y, z], unit: m}}]
""",
        encoding="utf-8",
    )
    return path


def _visit(cell: Cell, run: RunFolder) -> list[tuple[Streams, PoseLog]]:
    plan = make_plan(cell, jobs=1).plan
    run.streams.mkdir(parents=True)
    devices = simulated_devices(cell, seed=1)
    record = RunRecord(
        elastocal=plan.elastocal, plan="", cell="", cell_file=cell.path.name, seed=1, started=""
    )
    with Journal(run.journal) as journal:
        journal.write(devices.clock.now(), Event.START, run=record)
        hooks = SessionHooks(lambda: PoseRecorder(plan.robot.joints))
        Runner(Session(plan, run_settings(cell, plan), run), devices, journal, hooks).run()
    return [
        (read_streams(run.stream(commit.pose, commit.attempt)), commit)
        for commit in read_commits(run.journal)
    ]


def _draw_streams(cell: Cell, streams: Streams, commit: PoseLog) -> Figure:
    figure = new_figure(9.0, 5.2)
    upper, lower = figure.subplots(2, 1, sharex=True)
    unloaded, start = commit.windows[0], streams.arm.time[0]

    def since(time: np.ndarray, values: np.ndarray) -> np.ndarray:
        inside = (time >= unloaded.start) & (time <= unloaded.end)
        return values - values[inside].mean(axis=0)

    wrench, points, arm = streams.wrench, streams.points, streams.arm
    force = since(wrench.time, wrench.force)
    colours = (style.BLUE, style.VERMILLION, style.GREEN)
    for axis, colour, dashes, row in zip("xyz", colours, ("-", "--", "-."), force.T, strict=True):
        upper.plot(wrench.time - start, row, dashes, color=colour, lw=1.3, label=f"force {axis}")
    marker = 1e3 * np.linalg.norm(since(points.time, points.position), axis=1)
    T = arm.T_base_tcp
    place = T[:, :3, 3] + T[:, :3, :3] @ np.array(cell.file.marker.position_tcp)
    told = 1e3 * np.linalg.norm(since(arm.time, place), axis=1)
    lower.plot(points.time - start, marker, color=style.GREEN, lw=1.3, label="by the tracker")
    lower.plot(arm.time - start, told, "--", color=style.PURPLE, lw=1.5, label="by the controller")
    for window in commit.windows:
        middle = 0.5 * (window.start + window.end) - start
        for axes in (upper, lower):
            axes.axvspan(window.start - start, window.end - start, color="#f3e3c3", lw=0)
        label = window.load_case or "unloaded"
        above = upper.get_xaxis_transform()
        upper.text(middle, 1.02, label, transform=above, rotation=35, fontsize=8)
    upper.set(ylim=(-1250, 650), ylabel="force on the sensor in N")
    pressed = [(arm.time >= w.start) & (arm.time <= w.end) for w in commit.windows]
    highest = max(float(told[some].max()) for some in pressed)
    lower.set(ylim=(-0.2, 1.1 * highest), ylabel="marker displacement in mm")
    lower.set(xlabel="time since the pose was begun in s", xlim=(0.0, arm.time[-1] - start))
    for axes in (upper, lower):
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(loc="lower left", fontsize=8, framealpha=1.0)
    figure.subplots_adjust(left=0.09, right=0.97, top=0.86, bottom=0.1, hspace=0.08)
    return figure
