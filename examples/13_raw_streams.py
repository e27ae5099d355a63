"""One pose of Procedure 1 on the simulated cell, and the raw streams that it leaves.

You learn how a plan is carried out from Python, which files come out of it, and how to read the raw
samples again: what arm, force sensor and tracker said, and which stretches became readings. The
command `elastocal run` does the same for all poses, and derives the dataset.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

import elastocal as ec
from elastocal.planning import make_plan
from elastocal.procedure import (
    Event,
    Journal,
    RunFolder,
    Runner,
    RunRecord,
    Session,
    SessionHooks,
    read_streams,
    run_settings,
)
from elastocal.procedure.record import PoseRecorder, read_commits
from elastocal.sim.workcell import simulated_devices

folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(tempfile.mkdtemp(prefix="elastocal-"))
folder.mkdir(parents=True, exist_ok=True)

# A plan of a single pose: this is about the streams, not about the calibration.
cell_file = ec.init(folder / "cell", kind="afp").cell
text = cell_file.read_text(encoding="utf-8")
text = text.replace("pool: 3000", "pool: 20").replace("poses: 31", "poses: 1")
cell_file.write_text(text, encoding="utf-8")
cell = ec.load_cell(cell_file)
plan = make_plan(cell, jobs=1).plan

run = RunFolder(folder / "run")
run.streams.mkdir(parents=True, exist_ok=True)
devices = simulated_devices(cell, seed=1)
record = RunRecord(
    elastocal=plan.elastocal,
    plan="made in memory",
    cell=plan.cell.fingerprint,
    cell_file=cell_file.name,
    seed=1,
    started="not noted",
)
with Journal(run.journal) as journal:
    journal.write(devices.clock.now(), Event.START, run=record)
    hooks = SessionHooks(lambda: PoseRecorder(plan.robot.joints))
    result = Runner(Session(plan, run_settings(cell, plan), run), devices, journal, hooks).run()
seconds = devices.clock.now()
print(f"{result.end.value}, arm {result.location.value}, {seconds:.1f} s of the cell's time")

(commit,) = read_commits(run.journal)
streams = read_streams(run.stream(commit.pose, commit.attempt))
print(f"arm {len(streams.arm.time)}, wrench {len(streams.wrench.time)},", end=" ")
print(f"marker {len(streams.points.time)} samples")
for mark in streams.marks[:4]:
    print(f"  {mark.time:7.2f} s  {mark.text}")

# The stretches that became readings, averaged by hand: raw, in the sensor's and tracker's frames.
print(f"{'reading':10s} {'samples':>8s} {'raw force':>26s}   {'marker moved':>12s}")
unloaded = None
for window in commit.windows:
    inside = (streams.wrench.time >= window.start) & (streams.wrench.time <= window.end)
    seen = (streams.points.time >= window.start) & (streams.points.time <= window.end)
    force = streams.wrench.force[inside].mean(axis=0)
    marker = streams.points.position[seen].mean(axis=0)
    unloaded = marker if unloaded is None else unloaded
    moved = 1e3 * np.linalg.norm(marker - unloaded)
    print(
        f"{window.load_case or 'unloaded':10s} {inside.sum():8d}"
        f" {np.array2string(force, precision=1, floatmode='fixed'):>24s} N   {moved:9.3f} mm"
    )
