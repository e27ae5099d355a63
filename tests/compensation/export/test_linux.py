"""The C program for a real-time Linux: compiled, its own tests, and over loopback sockets."""

import json
import shutil
import signal
import subprocess
import time

import pytest

from elastocal import workflows
from elastocal.cell import load_cell
from elastocal.compensation.export import LinuxTarget
from elastocal.errors import CompensationError
from support.cli import PATIENCE
from support.exported import SANITIZED, needs_gcc
from support.live_on_wire import LiveFiles, served

pytestmark = [
    needs_gcc,
    pytest.mark.skipif(shutil.which("make") is None, reason="make is not on this machine"),
]
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
            wait(lambda: robot.statistics.answered > 120)
            here = robot.statistics.answered
            box.box.lose = 10**6
            wait(lambda: robot.statistics.answered > here + 90)
            box.box.lose = 0
            wait(lambda: robot.statistics.answered > here + 130)
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


def wait(holds, seconds=PATIENCE):
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.01)


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
