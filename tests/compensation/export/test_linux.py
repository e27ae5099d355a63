"""The C program for a real-time Linux: compiled, its own tests, and over loopback sockets."""

import json
import shutil
import signal
import subprocess
from collections import deque
from pathlib import Path

import numpy as np
import pytest

from elastocal import workflows
from elastocal.cell import load_cell
from elastocal.compensation.export import LinuxTarget
from elastocal.drivers.kuka_rsi.corrections import HeldCorrection
from elastocal.drivers.kuka_rsi.messages import Arrival, IpocWatch, RobMessage
from elastocal.errors import CompensationError, DeviceError
from support.cli import PATIENCE
from support.exported import HARNESS, SANITIZED, needs_gcc
from support.live_on_wire import LiveFiles, served
from support.waiting import until

pytestmark = [
    needs_gcc,
    pytest.mark.skipif(shutil.which("make") is None, reason="make is not on this machine"),
]
CYCLE = 0.004
LATE_CYCLES = 30
"""Cycles of the delay that is assumed where none was measured."""
BIAS = 250.0
"""A bias that the tool file states and the sensor has not, in N: as good as a force."""


def exported(files, folder, **options):
    return workflows.export(
        files.model, out=folder, platform="linux", cell=files.cell, tool=files.tool, **options
    )


def made(folder, *words):
    done = subprocess.run(
        ["make", "-C", folder, *words], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return folder / "elastocal_live"


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """The program, compiled with all warnings as errors, and the files that it was made from."""
    folder = tmp_path_factory.mktemp("linux")
    files = LiveFiles.written(folder / "files", BIAS)
    exported(files, folder / "c")
    return made(folder / "c", "check"), files


@pytest.mark.slow
def test_it_compiles_strictly_and_its_self_test_is_clean_under_the_sanitizers(program, tmp_path):
    folder = shutil.copytree(program[0].parent, tmp_path / "c")
    made(folder, "clean")
    flags = " ".join(["-O1", *SANITIZED])
    assert "-std=c11 -Wall -Wextra -Werror -pedantic" in (folder / "Makefile").read_text()
    made(folder, "check", f"CFLAGS={flags}", "LDFLAGS=-fsanitize=address,undefined")


def test_nothing_starts_without_arm(program):
    done = subprocess.run([program[0]], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "up to 1 mm at up to 30 mm/s" in done.stderr


def test_addresses_and_limits_are_those_of_the_cell_file(program):
    path, files = program
    text = (path.parent / "live_config.h").read_text()
    arm = workflows.rig_of(load_cell(files.cell)).wanted["kuka_rsi"]["arm"]
    assert f'LIVE_RSI_ADDRESS "127.0.0.1"\n#define LIVE_RSI_PORT {arm.port}\n' in text
    assert "#define LIVE_LARGEST 0.001 " in text
    assert "#define LIVE_STEP 0.00012" in text


def test_over_loopback_it_corrects_holds_fades_and_ends_at_zero(program):
    path, files = program
    with served(files) as (robot, box):
        process = subprocess.Popen([path, "--arm"], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        try:
            until(lambda: robot.statistics.answered > 120)
            here = robot.statistics.answered
            box.box.lose = 10**6
            until(lambda: robot.statistics.answered > here + 90)
            box.box.lose = 0
            until(lambda: robot.statistics.answered > here + 130)
            process.send_signal(signal.SIGINT)
            out, err = process.communicate(timeout=PATIENCE)
        finally:
            process.kill()
        stops = robot.statistics.stops
        offset = robot._robot._offset[0]
    assert process.returncode == 0, err.decode()
    found = json.loads(out)
    assert found["answered"] >= 250
    assert (found["malformed"], found["foreign"], found["jumps"], found["restarts"]) == (0, 0, 0, 1)
    assert found["corrected"] > 50
    assert found["held"] >= 10
    assert found["faded"] > 50
    assert 5e-5 < found["largest_correction"] <= 1e-3 + 1e-9
    assert found["largest_step"] <= 0.03 * 0.004 * (1 + 1e-6)
    assert found["answer"]["p50"] > 0.0
    assert "start the controller's program now" in err.decode()
    assert stops in ([], ["program ended"]), "Stop has ended RSI_MOVECORR"
    assert not offset.any()


@pytest.mark.slow
def test_what_is_refused_and_a_bad_status_are_said_when_they_happen(program):
    path, files = program
    telegram = b'<Rob><RIst X="1620,9999"/><IPOC>1</IPOC></Rob>'
    with served(files) as (robot, box):
        robot._malformed = deque([telegram])
        process = subprocess.Popen([path, "--arm"], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        try:
            until(lambda: robot.statistics.answered > 40)
            robot.inject("malformed")
            box.box.status = 0x80004000
            here = robot.statistics.answered
            until(lambda: robot.statistics.answered > here + 60)
            box.box.status = 0
            until(lambda: robot.statistics.answered > here + 400)
            process.send_signal(signal.SIGINT)
            out, err = process.communicate(timeout=PATIENCE)
        finally:
            process.kill()
    text = err.decode()
    assert "a telegram of 127.0.0.1 is refused: RIst: no number: decimal comma" in text
    assert "status 0x80004000, bad: the correction is held, then fades" in text
    found = json.loads(out)
    assert found["first_refused"] == found["last_refused"] == "RIst: no number: decimal comma"
    assert found["malformed"] == 1
    assert text.count("good again") == 1
    assert found["sensor_failure"] is None


def random_line(seed):
    """Return what a controller says whose line is bad, and what the Python makes of it, by rows."""
    rng = np.random.default_rng(seed)
    step, delay, timeout = 0.03 * CYCLE, int(rng.integers(1, 20)), 100
    watch, held = IpocWatch(CYCLE), HeldCorrection(step, timeout * CYCLE, LATE_CYCLES)
    rows, found = [], []
    ipoc, now, missed, has = (
        2**32 - 4 * int(rng.integers(1, 900)),
        5.0,
        0,
        float(rng.random() < 0.8),
    )
    effect_there, late, wanted = np.zeros(3), [np.zeros(3)] * delay, np.zeros(3)
    for _ in range(2500):
        event = rng.choice(7, p=[0.86, 0.03, 0.03, 0.02, 0.03, 0.01, 0.02])
        lost = (
            int(rng.integers(1, 12))
            if event == 1
            else int(rng.integers(100, 140))
            if event == 2
            else 0
        )
        ipoc, now, missed = ipoc + 4 * lost, now + CYCLE * lost, missed + lost
        late += [effect_there] * lost
        ipoc += {3: 1000, 4: -4 * int(rng.integers(1, 4)), 5: -400}.get(int(event), 0)
        if event == 5:
            effect_there, late, missed = np.zeros(3), [np.zeros(3)] * delay, 0
        late = [*late, effect_there][-delay:]
        if rng.random() < 0.05:
            wanted = rng.uniform(-1e-3, 1e-3, 3)
        ipoc, now = (ipoc + 4) % 2**32, now + CYCLE
        offset, anew = late[0] + rng.normal(0.0, 2e-6, 3), float(event == 6 and rng.random() < 0.3)
        arrival = watch.classify(ipoc, anew > 0.0)
        way = wanted - effect_there
        way *= min(1.0, 0.5 * step / max(float(np.linalg.norm(way)), 1e-12))
        rows.append([ipoc, anew, has, *offset, missed, now, *way])
        out = [list(Arrival).index(arrival), -2.0, 0.0, 0.0, 0.0, 0.0, 0.0]
        missed += 1
        if arrival is not Arrival.OUT_OF_ORDER:
            millimetres = tuple(1e3 * offset) + (0.0,) * 3
            told = {"actual": millimetres, "setpoint": (0.0,) * 6} if has else {}
            try:
                effect = held.look(RobMessage(ipoc, delay=missed - 1, **told), arrival, now)
                out[1] = 1.0 if effect is None else 0.0
            except DeviceError:
                effect, out[1] = None, -1.0
            if effect is not None:
                out[2:] = [effect.begins, effect.advances, *effect.shift]
                answer = np.array(effect.shift) + (way if effect.advances else 0.0)
                held.note(tuple(answer.tolist()))
                if rng.random() < 0.95:
                    effect_there, missed = answer, 0
        found.append(out)
    return np.array(rows, dtype=float), np.array(found, dtype=float)


@pytest.mark.slow
def test_python_and_c_see_the_same_correction_in_effect(program, tmp_path):
    folder = program[0].parent
    harness = Path(HARNESS.with_name("held_harness.c"))
    words = ["gcc", "-std=c11", "-Wall", "-Wextra", "-Werror", *SANITIZED, f"-I{folder}"]
    subprocess.run(
        [*words, harness, folder / "live_held.c", "-lm", "-o", tmp_path / "held"], check=True
    )
    kinds = set()
    for seed in range(6):
        rows, expected = random_line(seed)
        done = subprocess.run(
            [tmp_path / "held"], input=rows.tobytes(), capture_output=True, check=True
        )
        found = np.frombuffer(done.stdout).reshape(len(rows), -1)
        np.testing.assert_array_equal(found[:, :4], expected[:, :4])
        np.testing.assert_allclose(found[:, 4:], expected[:, 4:], rtol=0.0, atol=1e-12)
        kinds |= {tuple(row) for row in found[:, :3].astype(int)}
    assert {(4, 0, 0), (4, 0, 1), (4, 1, 0), (2, 0, 0), (3, -2, 0)} <= kinds


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"platform": "windows"}, r"target 'windows' is none.*known: linux"),
        ({"cell": None}, "needs --cell"),
        ({"tool": None}, "and --tool: a Net F/T gives raw wrenches"),
        ({"platform": None}, "a cell file is for --target linux"),
    ],
)
def test_what_belongs_together_is_asked_for(program, tmp_path, options, said):
    _, files = program
    usual = {"platform": "linux", "cell": files.cell, "tool": files.tool, "out": tmp_path / "c"}
    with pytest.raises(CompensationError, match=said):
        workflows.export(files.model, **(usual | options))
    assert not (tmp_path / "c").exists()


def test_an_address_is_a_number_since_it_stands_in_c():
    with pytest.raises(CompensationError, match="must be numbers, such as"):
        LinuxTarget(
            "cell", ('127.0.0.1"; system("x', 1), "127.0.0.1", "PC", 10, ("127.0.0.1", 1, 1), 0,
            (1.0,), 1e-3, 0.03, 0.12,
        )  # fmt: skip
