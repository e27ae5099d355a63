"""The exported C against the Python that it was made from."""

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
import pytest

from elastocal.compensation import ArmGrowth
from elastocal.compensation.export import write_c
from elastocal.compensation.kernel import BuiltArm
from elastocal.compensation.online import Compensator, Reading, Status, design
from elastocal.elastic import OneAxisSpring, Parameter, Unit, unit_of
from elastocal.elastic.layouts import SpringEntry, custom
from elastocal.elastic.springs.hinge import axial
from elastocal.errors import CompensationError
from elastocal.geometry import Payload, Positions
from elastocal.geometry.arm import ArmErrors, frames
from elastocal.geometry.positions import joint_loads
from elastocal.identification import RobotRecord
from elastocal.records import record
from elastocal.robot import Robot
from support import compensated, exported
from support.by_day import some_by_day
from support.exported import SANITIZED, build, needs_gcc, written
from support.filters import EXAMPLES, filter_settings
from support.geared import geared
from support.shared import GOLDEN, needs_shared
from support.virtual_chain import ARMS

pytestmark = needs_gcc
STATES = 100_000
PROCESSOR = Path("/proc/cpuinfo")


def random_rows(model, count, seed=0):
    """Return joints within their limits, forces and moments, a row each."""
    rng, limits = np.random.default_rng(seed), model.robot.limits
    lower, upper = np.maximum(limits.lower, -7.0), np.minimum(limits.upper, 7.0)
    q = rng.uniform(lower, upper, (count, len(lower)))
    return np.hstack([q, 1e3 * rng.normal(size=(count, 3)), 1e2 * rng.normal(size=(count, 3))])


def assert_deflections_agree(executable, calibrated, count):
    rows = random_rows(calibrated.model, count)
    found = executable.numbers("loads", rows)
    n = len(calibrated.model.robot.joint_names)
    q, force, moment = rows[:, :n], rows[:, n : n + 3], rows[:, n + 3 :]
    expected = calibrated.model.deflection(calibrated.compliance, q, force, moment)
    off = np.linalg.norm(found[:, :3] - expected, axis=1) / np.linalg.norm(expected, axis=1)
    assert off.max() < 1e-12
    block = calibrated.model.observation_blocks(q[:100], force[:100], moment[:100])
    deviation = (block @ calibrated.draws.T).std(axis=-1, ddof=1).max(axis=1)
    np.testing.assert_allclose(found[:100, 3], 1.959963984540054 * deviation, rtol=1e-6)


def soft_everywhere(robot):
    """Return axial springs and a custom list: linear, distal, off the axis, askew."""
    entries = tuple(
        SpringEntry(joint=joint, axis=axis, kind=kind, frame=frame, offset=offset)
        for joint in robot.joint_names[::2]
        for axis in ("x", (1.0, -2.0, 0.5))
        for kind in ("revolute", "prismatic")
        for frame, offset in (
            ("proximal", ("0 mm", "0 mm", "0 mm")),
            ("distal", ("30 mm", "-1 m", "2 mm")),
        )
    )
    return (*(axial(joint) for joint in robot.chain.joints), *custom(robot, entries))


@record()
class Sinking(OneAxisSpring):
    """A spring ``theta = c t (1 / (1 + u) + 1 / (1 + u))``, ``u = t^2 / T^2``, made to divide."""

    kind: Literal["sinking"] = "sinking"
    units: ClassVar[tuple[Unit, ...]] = (unit_of("rad/(N*m)"),)

    @property
    def parameters(self):
        return (Parameter(self.name, self.joint, self.units[0], 1e-6),)

    def angles(self, load):
        (t,) = load.torque
        return ((t * (1.0 / (1.0 + t * t / 1e6)) + 1e6 * t / (1e6 + t * t),),)

    def tangents(self, load):
        (t,) = load.torque
        slope = (1.0 - t * t / 1e6) / (1.0 + t * t / 1e6) ** 2
        return (((2.0 * slope,),),)


@pytest.mark.slow
def test_a_law_that_divides_by_the_load(tmp_path):
    robot = Robot.from_urdf(ARMS["on a rail"], "tcp")
    joints = robot.chain.joints[1:4]
    springs = tuple(Sinking(f"{each.name}.axial", each.name, axial(each).axis) for each in joints)
    calibrated = compensated.calibrated(robot, springs)
    executable = build(written(tmp_path, design(calibrated)), "-O1", *SANITIZED)
    assert_deflections_agree(executable, calibrated, 500)


at_many_states = pytest.mark.parametrize(
    "count", [10_000, pytest.param(STATES, marks=pytest.mark.slow, id="hundred thousand")]
)


@needs_shared
@at_many_states
def test_golden_robot(tmp_path, count):
    robot = Robot.from_file(GOLDEN / "golden_6r.urdf", "tcp")
    calibrated = compensated.calibrated(robot)
    executable = build(written(tmp_path, design(calibrated)), "-O2")
    assert_deflections_agree(executable, calibrated, count)


@pytest.mark.slow
@at_many_states
@pytest.mark.parametrize("like", ["afp", "machining"])
def test_example_robots_one_of_them_on_a_rail(tmp_path, like, count):
    calibrated = compensated.calibrated(compensated.example_robot(like, tmp_path / "cell"))
    executable = build(written(tmp_path / "c", design(calibrated)), "-O2")
    assert_deflections_agree(executable, calibrated, count)


@pytest.mark.parametrize(
    "name",
    [
        "on a rail",
        *(pytest.param(name, marks=pytest.mark.slow) for name in ARMS if name != "on a rail"),
    ],
)
def test_every_arm_with_springs_of_every_kind(tmp_path, name):
    robot = Robot.from_urdf(ARMS[name], "tcp")
    calibrated = compensated.calibrated(robot, soft_everywhere(robot))
    numbers = design(calibrated, compensated.settings(), compensated.load())
    executable = build(written(tmp_path, numbers), "-O1", *SANITIZED)
    assert_deflections_agree(executable, calibrated, 2000)
    assert executable.selftest() == 0


def course(rng, joints, count=2000):
    """Return readings as rows: mostly sound, with NaN, infinities, jumps and a bad clock."""
    time = 0.004 * np.arange(1, count + 1)
    time[rng.random(count) < 0.02] *= -3.0
    time[rng.random(count) < 0.02] = np.nan
    q = rng.uniform(-1.5, 1.5, joints) + 0.002 * rng.normal(size=(count, joints)).cumsum(axis=0)
    wrench = (rng.normal(size=(count, 6)) * [40, 40, 40, 4, 4, 4]).cumsum(axis=0)
    ok = rng.random((count, 1)) > 0.02
    rows = np.hstack([time[:, None], q, wrench, ok])
    for bad in (np.nan, np.inf, -np.inf, 1e308, 1e5):
        rows[rng.integers(0, count, 10), rng.integers(1, rows.shape[1] - 1, 10)] = bad
    gap = rng.integers(0, count - 100)
    rows[gap : gap + 60, -1] = 0.0
    return rows


@pytest.mark.parametrize(
    ("frame", "median", "calibrated"),
    [
        pytest.param("base", 3, "hinges", marks=pytest.mark.slow),
        pytest.param("tcp", 1, "hinges", marks=pytest.mark.slow),
        pytest.param(
            {"abc": ["30 deg", "-20 deg", "170 deg"]}, 5, "hinges", marks=pytest.mark.slow
        ),
        ("base", 3, "gears"),
        pytest.param("tcp", 1, "gears", marks=pytest.mark.slow),
    ],
)
def test_steps_are_those_of_python_and_clean_under_the_sanitizers(
    tmp_path, frame, median, calibrated
):
    # None, the last, every one.
    names = {1: (), 5: tuple(EXAMPLES)[-1:], 3: tuple(EXAMPLES)}[median]
    chosen = compensated.settings(frame=frame, filter=filter_settings(*names, median=median))
    model = geared() if calibrated == "gears" else compensated.arm("on a rail")
    numbers = design(model, chosen, compensated.load())
    executable = build(written(tmp_path, numbers), "-O1", *SANITIZED)
    rows = course(np.random.default_rng(median), numbers.joints)
    found = executable.numbers("steps", rows)
    lengths = np.linalg.norm(found[:, :3], axis=1)
    moves = np.linalg.norm(np.diff(found[:, :3], axis=0, prepend=0.0), axis=1)
    assert lengths.max() <= chosen.limits.correction * (1.0 + 1e-12)
    assert moves.max() <= numbers.largest_step * (1.0 + 1e-12)
    compensator, n = Compensator(numbers), numbers.joints
    state = compensator.start()
    for row, got in zip(rows.tolist(), found, strict=True):
        reading = Reading(row[0], row[1 : n + 1], row[n + 1 : n + 4], row[n + 4 : n + 7], row[-1])
        state, told = compensator.step(state, reading)
        expected = [*told.correction, *told.deflection, told.half_width, told.status]
        np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-15)


def grown_arm(robot):
    """Return a state of an arm that has grown by a fifth of a millimetre a metre."""
    date = "2026-11-02T06:00:00+00:00"
    return ArmGrowth(
        *("cell", RobotRecord.of(robot), date, date, 160.0, 0.2e-3, (1e-4, -2e-4, 3e-4), 1e-6),
        *((1e-5,) * 3, (), 2e-5, 1e-4, 3e-5, 2e-5),
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", some_by_day(["gears", "hinges"]))
def test_the_growth_of_an_arm_is_corrected_as_by_python(tmp_path, name):
    model = geared() if name == "gears" else compensated.arm("on a rail")
    state = grown_arm(model.model.robot)
    numbers = design(model, compensated.settings(), compensated.load(), state)
    executable = build(written(tmp_path, numbers), "-O1", *SANITIZED)
    assert executable.selftest() == 0
    rows, n = course(np.random.default_rng(5), numbers.joints), numbers.joints
    found = executable.numbers("steps", rows)
    assert np.linalg.norm(found[:, :3], axis=1).max() <= numbers.settings.limits.correction * (
        1.0 + 1e-12
    )
    compensator = Compensator(numbers)
    step = compensator.start()
    for row, got in zip(rows.tolist(), found, strict=True):
        reading = Reading(row[0], row[1 : n + 1], row[n + 1 : n + 4], row[n + 4 : n + 7], row[-1])
        step, told = compensator.step(step, reading)
        expected = [*told.correction, *told.deflection, told.half_width, told.status]
        np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-15)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("orders", "payload", "assumed"),
    some_by_day([(40, 30.0, False), (2, 0.0, False), (2, 30.0, True)]),
)
def test_the_error_of_the_arm_as_built_is_that_of_python(tmp_path, orders, payload, assumed):
    """Places, zeros, functions of the joints, weight and payload on joints and bearings, a tool."""
    model = compensated.arm("on a rail")
    robot, rng = model.model.robot, np.random.default_rng(orders)
    joints = len(robot.joint_names)
    place, motion = rng.normal(size=(joints, 6)), rng.normal(size=(joints, 3 + 2 * orders))
    motion[~np.array(robot.revolute), 2:-1] = 0.0
    # The compiler takes its time: one joint has all orders.
    motion[2:, 14:-1] = 0.0
    bend = 1e-7 * rng.normal(size=(joints, 3))
    sag = 1e-7 * assumed * rng.normal(size=joints)
    errors = ArmErrors(1e-3 * place, 1e-4 * motion, bend, sag)
    errors.motion[:, -1] *= 1e-3
    T_drawn, T_built = np.eye(4), np.eye(4)
    T_drawn[:3, 3], T_built[:3, 3] = (0.1, 0.0, 0.2), (0.1, 1e-3, 0.2)
    of_arm = errors.place, errors.motion, errors.bend, sag if assumed else None
    arm = BuiltArm(robot, *of_arm, T_drawn, T_built, payload, (0.0, 0.1, 0.2))
    numbers = design(model, compensated.settings(), compensated.load(), built=arm)
    executable = build(written(tmp_path, numbers), "-O1", *SANITIZED)
    assert executable.selftest() == 0
    q = rng.uniform(-3.0, 3.0, (200, joints))
    data = Positions.unloaded(q, Payload(payload, (0.0, 0.1, 0.2)))
    real = frames(robot, q, joint_loads(robot, data, assumed=assumed), errors).T_base_tcp @ T_built
    expected = (real - robot.forward(q) @ T_drawn)[:, :3, 3]
    assert np.abs(expected).max() > 1e-3
    np.testing.assert_allclose(executable.numbers("arm", q), expected, rtol=0.0, atol=1e-12)


def beginnings(rng, deflection, limit):
    """Return what comes before readings: courses that begin and end, with sound and bad offsets."""
    rows = np.zeros((len(deflection), 4))
    begins = rng.random(len(rows)) < 0.05
    rows[begins, 0] = 1.0
    rows[1:, 1:] = deflection[:-1] + rng.normal(0.0, 0.6 * limit, (len(rows) - 1, 3))
    rows[rng.random(len(rows)) < 0.005, 0] = 2.0
    for bad in (np.nan, np.inf, -np.inf, 1e308):
        rows[rng.choice(np.flatnonzero(begins), 3), rng.integers(1, 4, 3)] = bad
    return rows


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gears, grown", "hinges"])
def test_offsets_of_courses_are_those_of_python(tmp_path, name):
    model = compensated.arm("on a rail") if name == "hinges" else geared()
    state = None if name == "hinges" else grown_arm(model.model.robot)
    limits = {"correction": "3 mm", "rate": "30 mm/s", "fade": "5 mm/s", "offset": "1.5 mm"}
    numbers = design(model, compensated.settings(limits=limits), compensated.load(), state)
    executable = build(written(tmp_path, numbers), "-O1", *SANITIZED)
    assert executable.selftest() == 0
    rng, n = np.random.default_rng(8), numbers.joints
    rows = course(rng, n)
    deflection = executable.numbers("steps", rows)[:, 3:6]
    rows = np.hstack([rows, beginnings(rng, deflection, numbers.settings.limits.offset)])
    found = executable.numbers("courses", rows)
    assert np.linalg.norm(found[:, :3], axis=1).max() <= 3e-3 * (1.0 + 1e-12)
    moves = np.linalg.norm(np.diff(found[:, :3], axis=0, prepend=0.0), axis=1)
    assert moves.max() <= numbers.largest_step * (1.0 + 1e-12)
    compensator, taken = Compensator(numbers), 0
    step = compensator.start()
    for row, got in zip(rows.tolist(), found, strict=True):
        q, begins = row[1 : n + 1], row[n + 8]
        if begins == 1.0:
            step = compensator.begin_course(step, q, row[n + 9 :])
            assert step.refused == got[4]
            taken += not step.refused
        elif begins == 2.0:
            step = compensator.end_course(step)
        reading = Reading(row[0], q, row[n + 1 : n + 4], row[n + 4 : n + 7], row[n + 7])
        step, told = compensator.step(step, reading)
        np.testing.assert_allclose(got[:4], [*told.correction, told.status], rtol=1e-12, atol=1e-15)
    assert taken >= 20
    assert (found[:, 4] > 0.0).sum() >= 20


@pytest.mark.slow
def test_every_way_of_the_step_is_taken_by_that_course(tmp_path):
    numbers = design(compensated.arm("on a rail"), compensated.settings(), compensated.load())
    executable = build(written(tmp_path, numbers), "-O2")
    rows = course(np.random.default_rng(3), numbers.joints)
    seen = np.bitwise_or.reduce(executable.numbers("steps", rows)[:, 7].astype(int))
    assert seen & ~32 == 1023 & ~32  # the last flag is of courses, which begin in another test


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    numbers = design(compensated.arm(), compensated.settings(), compensated.load())
    return written(tmp_path_factory.mktemp("c"), numbers)


class TestSelfTest:
    @pytest.mark.slow
    def test_it_is_zero_at_every_level_of_optimisation(self, folder):
        for level in ("-O0", "-O3"):
            assert build(folder, level, name=f"run{level}").selftest() == 0

    def test_it_is_zero_with_fused_products_allowed(self, folder):
        assert build(folder, "-O2", "-ffp-contract=fast", name="fused").selftest() == 0

    @pytest.mark.slow
    @pytest.mark.skipif(
        not PROCESSOR.exists() or " fma " not in PROCESSOR.read_text(), reason="nothing is fused"
    )
    @pytest.mark.parametrize("flags", [(), ("-ffp-contract=fast", "-mfma")])
    def test_what_bends_nothing_but_for_rounding_has_the_flag_of_nothing(self, tmp_path, flags):
        """Fused products round otherwise: loads that cancel on one processor leave 1e-13 N."""
        numbers = design(compensated.arm(), compensated.settings(deadband="0 mm", filter={}))
        n = numbers.joints
        rows = np.zeros((20, n + 8))
        rows[:, 0], rows[:, 1 : n + 1], rows[:, -1] = 0.004 * np.arange(1, 21), 0.3, 1.0
        rows[10:, n + 1 : n + 7] = 1e-13
        status = build(written(tmp_path, numbers), "-O2", *flags).numbers("steps", rows)[:, 7]
        assert np.array_equal(status[5:10], status[15:])
        assert int(status[-1]) & Status.DEADBAND.value

    @pytest.mark.slow
    def test_a_change_of_any_one_constant_is_found(self, folder, tmp_path):
        text = (folder / "elastocal_model.c").read_text()
        head, definitions, rest = re.split(r"(?m)^(?=/\* ---- (?:Constants|Sine))", text)
        literals = list(re.finditer(r"(?<![\w.])-?\d[\d.]*(?:e[-+]?\d+)?(?=[,;\n}])", definitions))
        assert len(literals) > 150
        rng = np.random.default_rng(0)
        chosen = [literals[k] for k in rng.choice(len(literals), 5, replace=False)]
        (tmp_path / "elastocal_model.h").write_bytes((folder / "elastocal_model.h").read_bytes())
        for literal in chosen:
            number = float(literal[0])
            changed = (
                str(int(number) + 1)
                if "." not in literal[0] and "e" not in literal[0]
                else (repr(number * (1 + 1e-12) if number else 1e-300))
            )
            damaged = definitions[: literal.start()] + changed + definitions[literal.end() :]
            (tmp_path / "elastocal_model.c").write_text(head + damaged + rest)
            assert build(tmp_path, "-O0").selftest() == 1, literal[0]

    @pytest.mark.parametrize("name", ["CYCLE", "SAMPLE", "DELAY"])
    def test_a_time_that_is_changed_in_the_header_is_found(self, folder, tmp_path, name):
        header = (folder / "elastocal_model.h").read_text()
        changed = re.sub(rf"(#define ELASTOCAL_{name}) [\d.]+", r"\1 0.001", header)
        assert changed != header
        (tmp_path / "elastocal_model.h").write_text(changed)
        (tmp_path / "elastocal_model.c").write_bytes((folder / "elastocal_model.c").read_bytes())
        assert build(tmp_path, "-O0").selftest() == 1

    @pytest.mark.parametrize(
        ("old", "new", "code"),
        [
            ("s = x + ((x * y) * s)", "s = x - ((x * y) * s)", 2),
            ("- ((k[0]", "+ ((k[0]", 3),
            ("share = LARGEST_CORRECTION / length", "share = 1.0", 3),
            ("(passed > 0.0) && ", "", 3),
            ("state->correction[i] *= share", "state->correction[i] *= 0.5", 3),
            ("state->z1[s][i] *= share", "state->z1[s][i] *= 1.0", 3),
            ("state->missed += 1", "state->missed += 2", 3),
            ("deflection[i] + offset[i]", "deflection[i]", 3),
            ("o[i] = deviation[i] - o[i]", "o[i] = deviation[i]", 3),
            ("<= LARGEST_OFFSET)", "<= (2.0 * LARGEST_OFFSET))", 3),
            ("state->offset[i] = 0.0;\n    }\n    state->refused", "}\n    state->refused", 3),
            ("1000.0 * correction[i]", "1001.0 * correction[i]", 3),
            ("if (is_number(value) == 0) {", "if (0) {", 3),
            ("if (is_number(&reading->time) != 0) {\n        state", "if (1) {\n        state", 3),
        ],
    )
    def test_a_change_of_the_code_is_found(self, folder, tmp_path, old, new, code):
        text = (folder / "elastocal_model.c").read_text()
        assert old in text
        (tmp_path / "elastocal_model.h").write_bytes((folder / "elastocal_model.h").read_bytes())
        (tmp_path / "elastocal_model.c").write_text(text.replace(old, new))
        assert build(tmp_path, "-O0", "-Wno-error").selftest() == code


MACROS = ["__FINITE_MATH_ONLY__", "__FAST_MATH__", "__ASSOCIATIVE_MATH__"]
UNNAMED = [f"-U{name}" for name in MACROS]
"""As a compiler that does not say what it was told."""


class TestFastMath:
    @pytest.mark.parametrize(
        "flag",
        [
            "-ffast-math",
            "-Ofast",
            "-ffinite-math-only",
            "-funsafe-math-optimizations",
            "-D_M_FP_FAST=1",
        ],
    )
    def test_a_compiler_that_is_told_so_refuses_the_file(self, folder, tmp_path, flag):
        command = [exported.GCC, "-std=c99", "-O2", flag, "-c", folder / "elastocal_model.c"]
        done = subprocess.run(
            [*command, "-o", tmp_path / "m.o"], capture_output=True, text=True, check=False
        )
        assert done.returncode != 0
        assert 'error: #error "elastocal: compile with' in done.stderr

    @pytest.mark.parametrize("level", ["-O1", "-O3"])
    def test_nan_is_refused_without_the_help_of_the_compiler(self, folder, level):
        flags = (level, "-ffinite-math-only", *UNNAMED)
        executable = build(folder, *flags, name=f"finite{level}")
        assert executable.selftest() == 0
        numbers = design(compensated.arm(), compensated.settings(), compensated.load())
        rows = course(np.random.default_rng(3), numbers.joints)
        expected = build(folder, level, name=f"strict{level}").numbers("steps", rows)
        found = executable.numbers("steps", rows)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)

    def test_a_guard_that_the_compiler_drops_is_found_by_the_self_test(self, folder, tmp_path):
        text = (folder / "elastocal_model.c").read_text()
        guard = "(bits & UINT64_C(0x7FF0000000000000)) != UINT64_C(0x7FF0000000000000)"
        assert guard in text
        folded = text.replace(guard, "(bits == 0U) || (isfinite(*value) != 0)")
        (tmp_path / "elastocal_model.h").write_bytes((folder / "elastocal_model.h").read_bytes())
        (tmp_path / "elastocal_model.c").write_text(folded)
        flags = ("-O2", "-ffinite-math-only", *UNNAMED)
        assert build(tmp_path, *flags).selftest() == 3


@pytest.fixture(scope="module")
def with_friction(tmp_path_factory):
    numbers = design(geared(), compensated.settings(), compensated.load())
    return written(tmp_path_factory.mktemp("friction"), numbers)


class TestFriction:
    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("old", "new", "code"),
        [
            ("1.0 - (2.0 * steep)", "1.0 - steep", 2),
            ("sqrt(variance) + unknown[row]", "sqrt(variance)", 2),
            ("(state->unloaded >= FREE_CYCLES)", "(state->unloaded > FREE_CYCLES)", 3),
            ("        state->unloaded = 0;\n", "", 3),
            ("        state->unloaded += 1;\n", "", 3),
        ],
    )
    def test_a_change_of_the_code_is_found(self, with_friction, tmp_path, old, new, code):
        text = (with_friction / "elastocal_model.c").read_text()
        assert text.count(old) == 1
        header = (with_friction / "elastocal_model.h").read_bytes()
        (tmp_path / "elastocal_model.h").write_bytes(header)
        (tmp_path / "elastocal_model.c").write_text(text.replace(old, new))
        assert build(tmp_path, "-O0", "-Wno-error").selftest() == code

    def test_the_page_for_integrators_says_what_is_remembered(self, with_friction, folder):
        page = (with_friction / "README.md").read_text()
        assert "elastocal_rest" in page
        assert "@" not in page.replace("@ ", "")
        assert "elastocal_rest" not in (folder / "README.md").read_text()
        assert "memory" not in (folder / "elastocal_model.h").read_text()

    @pytest.mark.slow
    def test_angles_of_points_are_good_to_half_a_femtoradian(self, with_friction, tmp_path):
        source = tmp_path / "arcs.c"
        source.write_text(
            '#include "elastocal_model.c"\n#include <stdio.h>\nint main(void){double p[2],o;'
            "while(fread(p,8,2,stdin)==2){o=arc(p[0],p[1]);fwrite(&o,8,1,stdout);}return 0;}"
        )
        program = tmp_path / "arcs"
        command = [exported.GCC, "-std=c99", "-O2", f"-I{with_friction}", source, "-o", program]
        subprocess.run([*command, "-lm"], check=True)
        rng = np.random.default_rng(0)
        points = rng.normal(size=(40000, 2)) * np.exp(rng.uniform(-20.0, 20.0, (40000, 2)))
        special = [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (-1.0, 0.0), (0.0, -1.0), (1.0, 1.0)]
        points = np.concatenate([points, special])
        done = subprocess.run([program], input=points.tobytes(), capture_output=True, check=True)
        found = np.frombuffer(done.stdout)
        assert np.abs(found - np.arctan2(*points.T)).max() <= 5e-16


def test_sine_and_cosine_are_good_to_two_ulp_over_many_turns(folder, tmp_path):
    source = tmp_path / "sines.c"
    source.write_text(
        '#include "elastocal_model.c"\n#include <stdio.h>\nint main(void){double a,o[2];'
        "while(fread(&a,8,1,stdin)==1){sin_cos(a,&o[0],&o[1]);fwrite(o,8,2,stdout);}return 0;}"
    )
    command = [exported.GCC, "-std=c99", "-O2", f"-I{folder}", source, "-o", tmp_path / "s", "-lm"]
    subprocess.run(command, check=True)
    rng = np.random.default_rng(0)
    quarter = 0.25 * np.pi * np.arange(-64, 65)
    angles = np.concatenate([rng.uniform(-4, 4, 20000), rng.uniform(-999, 999, 20000), quarter])
    done = subprocess.run([tmp_path / "s"], input=angles.tobytes(), capture_output=True, check=True)
    found = np.frombuffer(done.stdout).reshape(-1, 2)
    for column, expected in zip(found.T, (np.sin(angles), np.cos(angles)), strict=True):
        assert (np.abs(column - expected) <= 2.0 * np.spacing(np.abs(expected)) + 1e-19).all()


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not on this machine")
@pytest.mark.parametrize("springs", some_by_day(["gears", "hinges"]))
def test_instructions_do_not_depend_on_the_input(tmp_path, springs):
    calibrated = geared() if springs == "gears" else compensated.arm()
    numbers = design(calibrated, compensated.settings(), compensated.load())
    executable = build(written(tmp_path, numbers), "-O2", "-DCOUNT", name="count")
    rows = random_rows(calibrated.model, 40)
    rows[:, -6:] *= 0.1
    output = tmp_path / "callgrind.out"
    command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={output}", executable.path]
    subprocess.run([*command, "count"], input=rows.tobytes(), capture_output=True, check=True)
    counts = {"deflection": [], "step": []}
    for dump in sorted(tmp_path.glob("callgrind.out.*"), key=lambda p: int(p.suffix[1:])):
        text = dump.read_text()
        what = re.search(r"Client Request: (\w+)", text)
        if what:
            counts[what[1]].append(int(re.search(r"(?m)^totals: (\d+)", text)[1]))
    assert len(counts["deflection"]) == len(rows)
    assert len(set(counts["deflection"])) == 1
    # The first reading has no time before it and is not used.
    steps = np.array(counts["step"][1:])
    # With friction the first steps, before the filters let a load through, ask what a free arm
    # remembers as well.
    assert np.ptp(steps) < (0.05 if springs == "gears" else 0.01) * steps.max()
    assert np.ptp(steps[-20:]) < 0.01 * steps.max()


@pytest.mark.slow
def test_cmake_builds_it_and_runs_the_self_test(tmp_path):
    cmake = shutil.which("cmake")
    if cmake is None:
        pytest.skip("cmake is not on this machine")
    folder = written(tmp_path / "c", design(compensated.arm("one joint")))
    for command in (["-S", folder, "-B", tmp_path / "b"], ["--build", tmp_path / "b"]):
        subprocess.run([cmake, *command], check=True, capture_output=True)
    assert subprocess.run([tmp_path / "b" / "elastocal_selftest"], check=False).returncode == 0


def test_what_does_not_agree_with_the_model_is_not_exported(tmp_path):
    numbers = design(compensated.arm("one joint"))
    wrong = dict(numbers.deflection.constants)
    name = next(name for name in wrong if name.startswith("compliance"))
    wrong[name] *= 1.0 + 1e-8
    numbers = replace(numbers, deflection=replace(numbers.deflection, constants=wrong))
    with pytest.raises(CompensationError, match=r"the deflection that would be exported differs"):
        write_c(tmp_path / "c", numbers)
    assert not (tmp_path / "c").exists()
