"""The online compensator, step by step, and the same in C.

You learn how readings become corrections: what happens while a force builds up, and when the sensor
goes silent. Beside it the same compensator is written as C99; where there is a C compiler, its
self-test is run and one deflection is compared with Python's.
"""

import ctypes
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import elastocal as ec
from elastocal.compensation import CompensatorSettings
from elastocal.compensation.export import write_c
from elastocal.compensation.online import Compensator, Reading, Status
from elastocal.elastic import layout
from elastocal.identification import calibrate
from elastocal.robot import T_from_xyzabc, catalogue, with_tool
from elastocal.sim.arm import (
    SHOP_FLOOR,
    Linkage,
    bearing_truth,
    measure,
    press_forces,
    press_poses,
)

folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(tempfile.mkdtemp(prefix="elastocal-"))
folder.mkdir(parents=True, exist_ok=True)

urdf = catalogue.urdf("KR 120 R2700 extra HA")
urdf = with_tool(urdf, "flange", "tcp", T_from_xyzabc(0.15, 0.0, 0.35, 0.0, 0.0, 0.0))
robot, linkage = ec.Robot.from_urdf(urdf, "tcp"), Linkage.from_urdf(urdf, "tcp")
rng = np.random.default_rng(4)
pressed = press_poses(linkage, 20, rng)
forces = press_forces(pressed.T_base_tcp)
data = measure(bearing_truth(linkage), pressed.joints, forces, SHOP_FLOOR, rng)
model = ec.ElasticModel(robot, layout(robot, "bearing"))
calibrated = calibrate(model, data.readings(robot.joint_names), rng).calibrated

# A wrench at the tool centre point, bias and weight removed; corrections in base, every 4 ms.
settings = CompensatorSettings.model_validate(
    {"limits": {"correction": "3 mm", "rate": "30 mm/s", "fade": "5 mm/s"}, "hold": "40 ms"}
)
compensator = Compensator.of(calibrated, settings)
state = compensator.start()
q = pressed.joints[0].tolist()
print("   time   force  correction (z of base)   status")
for cycle in range(150):
    time = 0.004 * cycle
    force = min(1100.0, 5500.0 * time)  # N, builds up within 0.2 s
    lost = time >= 0.4  # the sensor says NaN from here on
    pressing = float("nan") if lost else -force
    reading = Reading(time, q, [0.0, 0.0, pressing], [0.0, 0.0, 0.0])
    state, told = compensator.step(state, reading)
    if cycle % 15 == 14:
        flags = Status(told.status).name or "OK"
        print(f"{time:6.3f} s {force:5.0f} N {1e3 * told.correction[2]:8.3f} mm      {flags}")

Vector = ctypes.c_double * 3
names = write_c(folder / "target", compensator.design, force=True)
print("\nC written:", ", ".join(names))
cc = shutil.which("cc")
if cc is None:
    print("no C compiler here: the C was written, not tried")
else:
    library, source = (folder / "target" / name for name in ("model.so", "elastocal_model.c"))
    command = [cc, "-O2", "-std=c99", "-shared", "-fPIC", source, "-o", library, "-lm"]
    subprocess.run(command, check=True)
    compiled = ctypes.CDLL(str(library))
    print("self-test in C returns", compiled.elastocal_selftest())
    in_c, load = Vector(), forces[0, 0]
    compiled.elastocal_deflection((ctypes.c_double * len(q))(*q), Vector(*load), Vector(), in_c)
    in_python = model.deflection(calibrated.compliance, q, load)
    apart = np.abs(in_c - in_python).max()
    print(f"deflection {np.round(1e3 * in_python, 3)} mm; C differs by {apart:.0e} m")
