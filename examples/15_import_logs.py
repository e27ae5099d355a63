"""From logs of other programs to a dataset: one in a workbook, one in a ROS 2 bag, one as text.

You learn what `elastocal import` needs of a site that lets no PC drive its robot: three logs, each
by its own clock, and a map of their columns. The logs are made here from the raw streams of a small
simulated run, so that the dataset can be held against the one that the run derived itself.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from openpyxl import Workbook
from rosbags.rosbag2 import Writer
from rosbags.typesys import Stores, get_typestore

import elastocal as ec
from elastocal.procedure import read_commits, read_streams

folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(tempfile.mkdtemp(prefix="elastocal-"))
folder.mkdir(parents=True, exist_ok=True)
cell = ec.init(folder / "cell", kind="afp").cell
text = cell.read_text(encoding="utf-8").replace("pool: 3000", "pool: 40")
cell.write_text(text.replace("poses: 31", "poses: 5"), encoding="utf-8")
ec.plan(cell, out=folder / "plan")
ec.run(cell, plan=folder / "plan", out=folder / "run")

# What the devices said, as three programs of other makers would have written it.
visits = read_commits(folder / "run" / "journal.jsonl")
streams = [read_streams(folder / "run" / "streams" / visit.streams) for visit in visits]

book = Workbook(write_only=True)
sheet = book.create_sheet("RSI")
sheet.append(["time [s]", "E1 [mm]", *(f"A{n} [deg]" for n in range(1, 7))])
for visit in streams:
    time, q = visit.arm.time, visit.arm.q
    for row in np.column_stack([time, 1e3 * q[:, 0], np.degrees(q[:, 1:])]).tolist():
        sheet.append(row)
book.save(folder / "controller.xlsx")

types = get_typestore(Stores.ROS2_HUMBLE)
kind = "geometry_msgs/msg/WrenchStamped"
Time, Header, Vector, Wrench, Stamped = (
    types.types[name]
    for name in ("builtin_interfaces/msg/Time", "std_msgs/msg/Header", "geometry_msgs/msg/Vector3",
                 "geometry_msgs/msg/Wrench", kind)
)  # fmt: skip
with Writer(folder / "force", version=9) as bag:
    topic = bag.add_connection("/ft/wrench", kind, typestore=types)
    for visit in streams:
        wrench = visit.wrench
        for time, force, moment in zip(wrench.time, wrench.force, wrench.moment, strict=True):
            second, rest = divmod(round((time + 1.7e3) * 1e9), 10**9)
            message = Stamped(
                Header(Time(second, rest), "ft"), Wrench(Vector(*force), Vector(*moment))
            )
            bag.write(topic, second * 10**9 + rest, types.serialize_cdr(message, kind))

# A report as PolyWorks writes one: lines of its own, names of the columns, a row of their units.
with (folder / "tracker.txt").open("w", encoding="utf-8") as file:
    file.write("Text report\n\nName\tX\tY\tZ\tTime\n\t[mm]\t[mm]\t[mm]\t[s]\n")
    for visit in streams:
        for time, place in zip(visit.points.time, 1e3 * visit.points.position, strict=True):
            file.write(
                "p\t{:.4f}\t{:.4f}\t{:.4f}\t{:.3f}\n".format(*place, time * (1 + 40e-6) + 52.0)
            )

logs = [folder / name for name in ("controller.xlsx", "force", "tracker.txt")]
guess = ec.guess_map(logs, out=folder / "map.yaml", cell=cell.resolve())
for log, columns in guess.facts():
    print(f"{log:18s} {columns}")
found = ec.import_logs(logs, map=folder / "map.yaml", out=folder / "data.nc")
for label, said in found.facts():
    print(f"{label}: {said}")

run = ec.read_dataset(folder / "run" / "dataset.nc")
apart = found.dataset.marker_displacement - run.marker_displacement
print(f"{found.figures.readings} readings, the run had {int(run.usable.sum())};", end=" ")
print(f"marker displacements differ by {1e6 * np.sqrt(np.nanmean(apart**2)):.2f} µm")

# A site without a tracker has logs of arm and force all the same.
entries = (folder / "map.yaml").read_text(encoding="utf-8").split("  - log: ")
kept = [entries[0], *(entry for entry in entries[1:] if not entry.startswith("tracker.txt"))]
(folder / "no_tracker.yaml").write_text("  - log: ".join(kept), encoding="utf-8")
bare = ec.import_logs(logs[:2], map=folder / "no_tracker.yaml", out=folder / "no_tracker.nc")
print(f"without the tracker: {bare.figures.readings} readings; {bare.figures.warnings[-1]}")
