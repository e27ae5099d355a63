"""Valid files of every kind that commands read, and the commands that read them."""

import importlib.resources
import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from openpyxl import Workbook

from elastocal import dataset
from elastocal.cell import (
    ArmState,
    BeamState,
    Motion,
    PointBlock,
    SensorStatus,
    WrenchBlock,
    load_cell,
)
from elastocal.codec.study import StudyStore, run_study, study_summary, write_study
from elastocal.codec.study.sampling import ONE_AFTER_THE_OTHER
from elastocal.geometry import plan_positions
from elastocal.identification import read_model, write_model
from elastocal.planning import read_plan
from elastocal.planning.export import write_table
from elastocal.procedure import PoseRecorder, file_sha256
from elastocal.records import write_json
from elastocal.robot import catalogue, xyzabc_from_T
from elastocal.verdict import OF_RUN, make_key, read_private_key, sign, write_signature
from elastocal.workflows.simulate import Ports
from support import foreign_logs, kuka_bench, live_bench, reported, studies, two_arms
from support.cli import elastocal
from support.compensated import calibrated
from support.foreign_bags import write_bag
from support.measured_arms import measure, write_positions
from support.sealed import edit
from support.summaries import made_up_summary


@dataclass(frozen=True)
class Kind:
    """A kind of file."""

    file: str
    form: str
    """As in `fuzz.mutations.FORMS`."""
    commands: tuple[str, ...]
    """The first is the usual one; ``{f}`` is the file, ``{s}`` that of seeds, ``{o}`` a new one."""
    beside: tuple[str, ...] = ()
    """Files that must be there, too."""
    others: float = 0.1
    """How often another command than the first runs."""
    share: float = 1.0
    """How often this kind is drawn, beside others."""


_RUN = (
    "run/cell/cell.yaml",
    "run/cell/dome.stl",
    "run/plan/plan.json",
    "run/journal.jsonl",
    "run/dataset.nc",
    "run/summary.json",
    *(f"run/streams/pose_000{n}_1.mcap" for n in range(7)),
)
_MODEL = (
    "predict {f} {s}/rows.csv --out {o}.csv",
    "compensate {f} {s}/path.csv --out {o}.csv",
    "compare {f} {s}/old.json --json",
    "compare {s}/old.json {f} --rows {s}/rows.csv --out {o}.json",
    "export {f} --c {o}",
    "stiffness {f} {s}/path.csv --spins 2 --stands 1 --stations 2 --out {o}",
    "report {f} --out {o}.html",
)
_AS_BUILT = (
    "predict {s}/arm.json {s}/arm.csv --geometry {f} --out {o}.csv",
    "compensate {s}/arm.json {s}/arm.csv --geometry {f} --payload 80kg --out {o}.csv",
)
_KUKA = ("dome.stl", "commissioning.json")
_DATA = (
    "check {f}",
    "calibrate {f} --out {o}.json --draws 40",
    "calibrate {f} --out {o}.json --draws 40 --springs actuated --json",
    "compare {s}/old.json {s}/model.json --rows {f}",
)
_REPORT = (
    "report run --model {s}/model.json --tool {s}/tool.json --codec {s}/codec"
    " --process {s}/process --out {o}.html"
)
_LOGS = ("map.yaml", "controller.csv", "force.csv", "tracker.txt", "cell.yaml", "dome.stl")
_GUESS = "import {f} --map {o}.yaml --guess"
_IMPORT = "import controller.csv force.csv tracker.txt --map map.yaml --out {o}.nc"
_STUDY = ("study/settings.json", "study/study.json", "study/samples/000000-000000.json")
_BASE = "--base 0m,0m,0m,0deg,0deg,0deg --out {o}.src"

KINDS: dict[str, Kind] = {
    "cell": Kind(
        "cell.yaml",
        "yaml",
        ("check {f}", "run {f} --plan {s}/plan --out {o} --dry-run"),
        ("dome.stl",),
        0.03,
        1.5,
    ),
    "rig": Kind(
        "rig.yaml",
        "yaml",
        ("run {f} --plan {s}/plan --out {o} --dry-run",),
        ("dome.stl",),
        0.0,
        0.5,
    ),
    "kuka": Kind(
        "kuka.yaml",
        "yaml",
        (
            "krc-config {f} --out {o}",
            "check {f}",
            "run {f} --plan {s}/plan --out {o} --dry-run",
            "simulate {f} --ports {o}.json",
        ),
        _KUKA,
        0.1,
        0.7,
    ),
    "trackers": Kind(
        "trackers.yaml",
        "yaml",
        ("run {f} --plan {s}/plan --out {o} --dry-run", "simulate {f} --ports {o}.json"),
        ("dome.stl",),
        0.1,
        0.3,
    ),
    "controller's file": Kind(
        "elcal_run.xml", "xml", ("krc-config {s}/kuka.yaml --check {f}",), (), 0.0, 0.7
    ),
    "commissioning": Kind(
        "commissioning.json",
        "json",
        ("check {f}", "krc-config kuka.yaml --out {o}"),
        ("kuka.yaml", "dome.stl"),
        0.5,
        0.5,
    ),
    "live": Kind("live.json", "json", ("check {f}",), (), 0.0, 0.2),
    "ports": Kind("ports.json", "json", ("check {f}",), (), 0.0, 0.2),
    "springs": Kind(
        "springs.yaml",
        "yaml",
        ("check {f}", "calibrate {s}/dataset.nc --springs {f} --draws 40 --out {o}.json"),
    ),
    "settings": Kind(
        "settings.yaml", "yaml", ("check {f}", "export {s}/model.json --settings {f} --c {o}")
    ),
    "dataset": Kind("dataset.nc", "netcdf", _DATA, (), 0.1, 1.5),
    "table": Kind("dataset.csv", "csv", _DATA, (), 0.05, 1.0),
    "rows": Kind(
        "rows.csv", "csv", ("predict {s}/model.json {f} --out {o}.csv", "check {f}"), (), 0.3
    ),
    "path": Kind(
        "path.csv",
        "csv",
        (
            "check {f}",
            "compensate {s}/model.json {f} --out {o}.csv",
            "stiffness {s}/model.json {f} --spins 2 --stands 1 --stations 2 --out {o}",
        ),
        (),
        0.3,
        0.5,
    ),
    "poses": Kind(
        "poses.csv",
        "csv",
        ("check {f}", "compensate {s}/model.json {f} --out {o}.csv"),
        (),
        0.3,
        0.5,
    ),
    "postures": Kind("postures.csv", "csv", ("tool {f} --out {o}.json", "check {f}"), (), 0.3, 0.5),
    "deviations": Kind(
        "process/deviations.csv",
        "csv",
        ("check process", "check {f}"),
        ("process/table.json",),
        0.3,
        0.2,
    ),
    "model": Kind("model.json", "json", ("check {f}", *_MODEL), (), 0.2, 1.5),
    "tool": Kind("tool.json", "json", ("check {f}", "export {s}/model.json --tool {f} --c {o}")),
    "plan": Kind(
        "plan/plan.json",
        "json",
        ("check {f}", "run {s}/cell.yaml --plan plan --out {o} --dry-run"),
        (),
        0.1,
    ),
    "pool": Kind("pool.nc", "netcdf", ("check {f}",), (), 0.0, 0.5),
    "codec": Kind(
        "codec/codec.nc", "netcdf", ("check {f}", "check codec"), ("codec/codec.json",), 0.3
    ),
    "verdicts": Kind(
        "codec/codec.json", "json", ("check {f}", "check codec"), ("codec/codec.nc",), 0.3
    ),
    "process": Kind(
        "process/table.json",
        "json",
        ("check {f}", "check process"),
        ("process/deviations.csv",),
        0.1,
    ),
    "comparison": Kind("comparison.json", "json", ("check {f}",), (), 0.0, 0.5),
    "journal": Kind("run/journal.jsonl", "jsonl", ("check {f}", "check run"), _RUN, 0.05),
    "summary": Kind("run/summary.json", "json", ("check {f}", _REPORT), _RUN, 0.02),
    "stream": Kind("stream.mcap", "mcap", ("check {f}",), (), 0.0, 1.0),
    "derived": Kind("run/streams/pose_0003_1.mcap", "bytes", ("derive run",), _RUN, 0.0, 0.01),
    "robot": Kind(
        "robot.urdf",
        "xml",
        ("check {f}", "calibrate {s}/dataset.nc --robot {f} --tcp tcp --draws 40 --out {o}.json"),
        (),
        0.05,
        1.5,
    ),
    "mesh": Kind("dome.stl", "bytes", ("check cell.yaml",), ("cell.yaml",), 0.0, 0.1),
    "mesh text": Kind(
        "fixture.stl",
        "text",
        ("check meshed.yaml",),
        ("meshed.yaml", "dome.stl", "fixture.obj"),
        0.0,
        0.1,
    ),
    "mesh obj": Kind(
        "fixture.obj",
        "text",
        ("check meshed.yaml",),
        ("meshed.yaml", "dome.stl", "fixture.stl"),
        0.0,
        0.1,
    ),
    "program": Kind(
        "course.src",
        "text",
        ("compensate {s}/model.json {f} --forces {s}/forces.csv " + _BASE,),
        ("course.dat",),
        0.0,
        0.5,
    ),
    "positions": Kind(
        "course.dat",
        "text",
        ("compensate {s}/model.json course.src --forces {s}/forces.csv " + _BASE,),
        ("course.src",),
        0.0,
        0.5,
    ),
    "catalogue": Kind("catalogue.yaml", "yaml", ("check {f}",), (), 0.0, 0.3),
    "log map": Kind("map.yaml", "yaml", ("check {f}", _IMPORT), _LOGS, 0.2),
    "log": Kind("controller.csv", "csv", (_GUESS, _IMPORT), _LOGS, 0.1, 0.5),
    "point list": Kind("tracker.txt", "text", (_GUESS, _IMPORT), _LOGS, 0.1, 0.3),
    "workbook": Kind("force.xlsx", "workbook", (_GUESS,), (), 0.0, 0.5),
    "recording": Kind("foreign.mcap", "mcap", (_GUESS,), (), 0.0, 0.5),
    "bag": Kind("log.bag", "bytes", (_GUESS,), (), 0.0, 0.3),
    "bag of ROS 2": Kind(
        "log/log.db3",
        "bytes",
        ("import log --map {o}.yaml --guess",),
        ("log/metadata.yaml",),
        0.0,
        0.3,
    ),
    "metadata of a bag": Kind(
        "log/metadata.yaml",
        "yaml",
        ("import log --map {o}.yaml --guess",),
        ("log/log.db3",),
        0.0,
        0.3,
    ),
    "marker positions": Kind(
        "positions.csv",
        "csv",
        ("geometry {f} --robot {s}/arm.urdf --tcp flange --draws 40 --out {o}.json",),
        (),
        0.0,
        0.7,
    ),
    "geometry": Kind("geometry.json", "json", ("check {f}", *_AS_BUILT), (), 0.5, 0.7),
    "position plan": Kind("positions.json", "json", ("check {f}",), (), 0.0, 0.3),
    "plan table": Kind("plan.csv", "csv", ("check {f}",), (), 0.0, 0.3),
    "study settings": Kind(
        "study/settings.json", "json", ("check {f}", "check study"), _STUDY, 0.3, 0.3
    ),
    "study samples": Kind(
        "study/samples/000000-000000.json", "json", ("check {f}", "check study"), _STUDY, 0.3, 0.3
    ),
    "study": Kind("study/study.json", "json", ("check {f}",), _STUDY, 0.3, 0.3),
    "signature": Kind("run/signature.json", "json", ("check {f}", "verify run"), _RUN, 0.03, 0.5),
    "public key": Kind(
        "key.pub", "text", ("verify report.html --key {f}",), ("report.html",), 0.0, 0.3
    ),
    "private key": Kind(
        "key",
        "text",
        ("run {s}/cell.yaml --plan {s}/plan --out {o} --dry-run --sign {f}",),
        (),
        0.0,
        0.1,
    ),
    "report": Kind("report.html", "page", ("verify {f}", "verify {f} --key {s}/key.pub"), (), 0.3),
    "forces": Kind(
        "forces.csv",
        "csv",
        ("compensate {s}/model.json course.src --forces {f} " + _BASE,),
        ("course.src", "course.dat"),
        0.0,
        0.3,
    ),
}
"""All kinds of files, by name."""

_DEVICES = """devices:
  arm: simulated
  sensor: {driver: net_ft, address: 127.0.0.1, port: 49152, tcp_port: null, rate: 1000.0}
  clock_rate: 2
"""
_KUKA_DEVICES = """devices:
  arm:
    driver: kuka_rsi
    mode: contact
    address: "127.0.0.1"
    port: 0
    robot: "127.0.0.1"
    cycle: "12 ms"
    signs: [1, -1, 1, 1, 1, -1]
    commissioning: commissioning.json
    largest_correction: "150 mm"
    correction_speed: "50 mm/s"
    ptp_percent: 30
    contact_stiffness: "1 MN/m"
    wait: "0.1 s"
"""
_TRACKER_DEVICES = """devices:
  metrology:
    driver: line_stream
    stations: {station_1: {address: 127.0.0.1, port: 7000}, station_2: {port: 7001}}
    columns: ["t[s]", "x[mm]", "y[mm]", "z[mm]"]
    rate: "100 Hz"
    silence: "0.2 s"
  sensor: {driver: net_ft, tool_transform: [0, 0, 0, 0, 0, 0]}
"""
_SPRINGS = """schema: elastocal.springs/1
include: actuated
springs:
  - {joint: joint_a2, axis: x, name: "between [x]"}
  - {joint: joint_a3, axis: [0, 1, 1], frame: distal, bounds: ["0.5 MN*m/rad", "5 MN*m/rad"]}
  - {joint: joint_a6, axis: z, kind: prismatic, offset: ["0 mm", "0 mm", "150 mm"]}
  - {joint: joint_a4, axis: x, stiffness: "1.2 MN*m/rad", uncertainty: "20 %"}
"""
_SETTINGS = """schema: elastocal.compensator/1
cycle: "4 ms"
deadband: "0.01 mm"
uncertain_above: "5 mm"
filter:
  median: 3
  notches: [{frequency: "50 Hz", width: "10 Hz"}]
  low_pass: {cutoff: "15 Hz", order: 4}
sensor: {force: ["2500 N", "2500 N", "6250 N"], moment: ["400 N*m", "400 N*m", "400 N*m"]}
limits: {correction: "3 mm", rate: "30 mm/s", fade: "5 mm/s"}
"""
_CUBE = """solid cube
facet normal 0 0 1
outer loop
vertex 0 0 100
vertex 100 0 100
vertex 0 100 100
endloop
endfacet
facet normal 0 0 -1
outer loop
vertex 0 0 0
vertex 0 100 0
vertex 100 0 0
endloop
endfacet
endsolid cube
"""
_OBJ = "# a wedge\nv 0 0 0\nv 100 0 0\nv 0 100 0\nv 0 0 100\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def make_seeds(folder: Path) -> None:
    """Fill a new folder with valid files, each under the name that its kind says."""
    made = reported.finished()
    for name in ("run", "codec", "process", "plan"):
        shutil.copytree(
            made / name, folder / name, ignore=shutil.ignore_patterns("*.svg", "*.png", "*.html")
        )
    for name in (
        "model.json",
        "tool.json",
        "cell/cell.yaml",
        "cell/dome.stl",
        "run/dataset.nc",
        "plan/pool.nc",
    ):
        shutil.copy(made / name, folder / Path(name).name)
    (folder / "springs.yaml").write_text(_SPRINGS)
    (folder / "settings.yaml").write_text(_SETTINGS)
    (folder / "fixture.stl").write_text(_CUBE)
    (folder / "fixture.obj").write_text(_OBJ)
    cell = (folder / "cell.yaml").read_text(encoding="utf-8")
    meshes = "".join(
        f"\n  - {{name: {suffix}, mesh: {{file: fixture.{suffix}, unit: mm}},"
        ' pose: {xyz: ["9 m", "9 m", "9 m"]}}'
        for suffix in ("stl", "obj")
    )
    (folder / "meshed.yaml").write_text(cell.replace("\nfixtures:", f"\nfixtures:{meshes}", 1))
    (folder / "rig.yaml").write_text(f"{cell}\n{_DEVICES}")
    (folder / "trackers.yaml").write_text(f"{cell}\n{_TRACKER_DEVICES}")
    _write_kuka(folder, f"{cell}\n{_KUKA_DEVICES}")
    data = dataset.read(folder / "dataset.nc")
    dataset.write(data, folder / "dataset.csv")
    (folder / "robot.urdf").write_text(str(data.attributes["robot_urdf"]))
    _write_paths(folder)
    _write_poses(folder)
    _write_stream(folder / "stream.mcap", data.joint_names)
    _write_logs(folder)
    _write_geometry(folder)
    _write_study(folder / "study")
    _write_keys(folder)
    _write_pair(folder)
    shutil.copy(folder / "model.json", folder / "old.json")
    edit(folder / "old.json", _soften)
    _done(
        "compare", folder / "old.json", folder / "model.json", "--out", folder / "comparison.json"
    )


def _write_pair(folder: Path) -> None:
    """Write what belongs to two robots: cell, plan, readings, models, paths."""
    made = two_arms.finished()
    shutil.copytree(made / "models", folder / "pair_models")
    for name, own in (
        ("pair.yaml", "cell.yaml"),
        ("pair_plan.json", "plan.json"),
        ("pair.json", "models/pair.json"),
        ("left.nc", "run/left.nc"),
        ("right.nc", "run/right.nc"),
        ("left_path.csv", "left_path.csv"),
        ("right_path.csv", "right_path.csv"),
    ):
        shutil.copy(made / own, folder / name)


def _soften(model: dict) -> None:
    model["compliance"] = [1.02 * value for value in model["compliance"]]


def _write_kuka(folder: Path, cell: str) -> None:
    """Write a cell with a KUKA, the record of its delay, its controller's file, and ports."""
    (folder / "kuka.yaml").write_text(cell)
    robot = load_cell(folder / "kuka.yaml").robot.name
    write_json(folder / "commissioning.json", replace(kuka_bench.record(cycle=0.012), robot=robot))
    _done("krc-config", folder / "kuka.yaml", "--out", folder / "krc")
    shutil.copy(folder / "krc" / "elcal_run.xml", folder)
    write_json(folder / "live.json", live_bench.result())
    write_json(folder / "ports.json", Ports("127.0.0.1", {"net_ft": {"udp": 1, "http": 2}}))


def _write_paths(folder: Path) -> None:
    """Write rows of joints, a path of joints and one of poses, and postures of a tool."""
    lines = (folder / "process" / "path.csv").read_text().splitlines()
    names = lines[0].split(",")
    joints = slice(names.index("rail[m]"), None)
    rows = [line.split(",") for line in lines[1::7]]
    (folder / "rows.csv").write_text(
        "\n".join(",".join(row[joints]) for row in [names, *rows]) + "\n"
    )
    (folder / "path.csv").write_text("\n".join(lines[:40]) + "\n")
    rng, table = (
        np.random.default_rng(1),
        "a[deg],b[deg],c[deg],force_x[N],force_y[N],force_z[N],moment_x[N*m],moment_y[N*m],moment_z[N*m]\n",
    )
    for _ in range(24):
        angles, wrench = rng.uniform(-180, 180, 3), rng.normal(0, (100,) * 3 + (10,) * 3)
        table += ",".join(f"{value:.4f}" for value in (*angles, *wrench)) + "\n"
    (folder / "postures.csv").write_text(table)


def _write_poses(folder: Path) -> None:
    """Write the first rows as poses, and as a KUKA program with its points and forces."""
    rows = [line.split(",") for line in (folder / "rows.csv").read_text().splitlines()[1:6]]
    robot = read_model(folder / "model.json").model.robot
    joints = np.array([[float(cell) for cell in row[:7]] for row in rows])
    units = np.array([1e3] * 3 + [180.0 / np.pi] * 3)
    poses = [xyzabc_from_T(robot.forward(q)) * units for q in joints]
    head = "x[mm],y[mm],z[mm],a[deg],b[deg],c[deg],rail[m],force_x[N],force_y[N],force_z[N]\n"
    (folder / "poses.csv").write_text(
        head
        + "".join(
            ",".join(map(repr, map(float, (*pose, q[0], 10, 0, -500)))) + "\n"
            for pose, q in zip(poses, joints, strict=True)
        )
    )
    places = [
        ",".join(f"{k} {v:.6f}" for k, v in zip("XYZABC", pose, strict=True)) for pose in poses
    ]
    extra = [
        ",".join([f"E1 {1e3 * q[0]:.6f}", *(f"E{n} 0.0" for n in range(2, 7))]) for q in joints
    ]
    axes = ",".join(f"A{n} {v:.6f}" for n, v in enumerate(np.degrees(joints[0, 1:]), start=1))
    points = "".join(f"DECL E6POS XP{n}={{{places[n]},{extra[n]}}}\n" for n in range(5))
    (folder / "course.dat").write_text(
        f"DEFDAT course\nDECL E6AXIS XHOME={{{axes},{extra[0]}}}\n{points}ENDDAT\n"
    )
    lines = "".join(f"LIN XP{n} C_DIS\n" for n in range(5))
    (folder / "course.src").write_text(
        f"DEF course( )\n$BASE = BASE_DATA[1]\nPTP XHOME\n{lines}PTP XHOME\nEND\n"
    )
    forces = "".join(f"XP{n},10,0,-500\n" for n in range(5))
    (folder / "forces.csv").write_text(
        f"point,force_tcp_x[N],force_tcp_y[N],force_tcp_z[N]\n{forces}"
    )


def _write_stream(path: Path, joints: tuple[str, ...]) -> None:
    """Write raw streams of a few samples."""
    recorder, time = PoseRecorder(joints), 0.01 * np.arange(1, 9)
    for moment in time:
        recorder.arm(
            ArmState(
                float(moment),
                np.zeros(len(joints)),
                np.eye(4),
                Motion.HOLDING,
                False,
                None,
                "made up",
            )
        )
    numbers = np.ones((len(time), 3))
    recorder.wrenches(WrenchBlock(time, numbers, numbers, 0.5, 0.02, SensorStatus.OK, "made up"))
    recorder.points(
        PointBlock(time, numbers, 1e-5 * numbers, BeamState.LOCKED, "station_1", "made up")
    )
    recorder.mark(0.1, "a mark")
    recorder.save(path)


def _write_logs(folder: Path) -> None:
    """Write three logs of other programs with their map, a workbook, a recording and bags."""
    rows = foreign_logs.rows_of(folder / "run")
    steps = {"q": 2, "T": 2, "arm_time": 2}
    rows = foreign_logs.Rows(
        *(getattr(rows, name)[:: steps.get(name, 8)] for name in rows.__dataclass_fields__)
    )
    foreign_logs.write_logs(rows, folder)
    foreign_logs.write_map(folder, Path("cell.yaml"))
    book = Workbook()
    for row in [("t", "Fx", "Fy", "Fz"), *np.column_stack([rows.force_time, rows.force])[:50]]:
        book.active.append(list(row))
    book.save(folder / "force.xlsx")
    shutil.copy(folder / "run" / "streams" / "pose_0002_1.mcap", folder / "foreign.mcap")
    for form in ("ros1", "ros2"):
        write_bag(folder, form)


def _write_geometry(folder: Path) -> None:
    """Write absolute positions of markers on the robot, the geometry in them, and a catalogue."""
    robot = catalogue.load("KR 210 R2700-2")
    (folder / "arm.urdf").write_text(robot.urdf)
    write_positions(folder / "positions.csv", measure(robot, 40))
    _done(
        *("geometry", folder / "positions.csv", "--robot", folder / "arm.urdf", "--tcp", "flange"),
        *("--draws", 40, "--out", folder / "geometry.json"),
    )
    write_model(folder / "arm.json", calibrated(robot), made_up_summary())
    heads = [f"{name}[rad]" for name in robot.joint_names] + [f"force_{a}[N]" for a in "xyz"]
    (folder / "arm.csv").write_text(f"{','.join(heads)}\n0,-1,1,0,0.5,0,0,0,-500\n")
    write_json(
        folder / "positions.json", plan_positions(load_cell(folder / "cell.yaml"), 6, seed=1)
    )
    table = importlib.resources.files(catalogue) / "robots.yaml"
    (folder / "catalogue.yaml").write_text(table.read_text(encoding="utf-8"))
    write_table(folder, read_plan(folder / "plan" / "plan.json"))


def _write_study(folder: Path) -> None:
    design = studies.settings()
    results = run_study(StudyStore(folder), design, 3, studies.simulate, ONE_AFTER_THE_OTHER)
    write_study(folder, design, results, study_summary(design, results, 5e-5))


def _write_keys(folder: Path) -> None:
    """Write a key pair, and sign a run's journal and its report."""
    make_key(folder / "key")
    signed = sign(
        read_private_key(folder / "key"), OF_RUN, file_sha256(folder / "run" / "journal.jsonl"),
        reported.MADE,
    )  # fmt: skip
    write_signature(folder / "run" / "signature.json", signed)
    _done("report", folder / "run", "--out", folder / "report.html", "--sign", folder / "key")


def _done(*arguments: object) -> None:
    done = elastocal(*arguments)
    assert done.code == 0, (arguments, done.err)
