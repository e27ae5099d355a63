"""From a cell file to calibration poses in visiting order.

You learn how to write an example cell, plan it, read the plan, and keep it. Every pose carries the
margin of every check; the smallest one tells where the cell is tight.
"""

import sys
import tempfile
from pathlib import Path

import elastocal as ec

folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(tempfile.mkdtemp(prefix="elastocal-"))
folder.mkdir(parents=True, exist_ok=True)

# A smaller pool than the example's 3000 keeps this short.
cell_file = ec.init(folder / "cell", kind="machining").cell
text = cell_file.read_text(encoding="utf-8").replace("pool: 3000", "pool: 200")
cell_file.write_text(text, encoding="utf-8")

ec.plan(cell_file, out=folder / "plan", jobs=1)
plan = ec.read_plan(folder / "plan")
print(f"{len(plan.poses)} poses from {plan.pool.valid} candidates, by {plan.search.name}")
print(f"covering radius {1e3 * plan.search.covering_radius:.0f} mm")
for note in plan.findings:
    print("note:", note)

tightest = min(plan.poses, key=lambda pose: pose.margins["torque"])
print(f"least torque margin: {100 * tightest.margins['torque']:.0f} %, at pose {tightest.id}")
for pose in plan.poses[:3]:
    x, y, z = (1e3 * value for value in pose.tcp_position)
    print(f"pose {pose.id}: contact at {x:.0f}, {y:.0f}, {z:.0f} mm, seen by {pose.seen_by}")
