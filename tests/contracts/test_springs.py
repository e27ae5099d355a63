"""What every kind of spring keeps: place, law, tangent, units, files, fit, C."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from elastocal.compensation.online import Compensator, Reading, design
from elastocal.elastic import KINDS, ElasticModel, Gear, Hinge, Spring, SpringLoad, Unit, unit_of
from elastocal.elastic.known import Knowledge
from elastocal.elastic.springs.hinge import axial
from elastocal.elastic.springs.tensor import Tensor
from elastocal.errors import SchemaError, SpringError
from elastocal.identification import (
    CalibratedModel,
    Observability,
    build,
    calibrate,
    read_model,
    solve,
    write_model,
)
from elastocal.identification.displacement import displacement_blocks
from elastocal.testing import SpringSuite
from support.cells import linkage, robot
from support.exported import build as compiled_c, needs_gcc, written
from support.geared import heavy_robot
from support.problems import campaign
from support.virtual_chain import configurations, numerical_column

AXIS = (0.6, 0.0, 0.8)
CASES: dict[str, Spring] = {
    "hinge": Hinge("joint_3.x", "joint_3", (1.0, 0.0, 0.0)),
    "linear hinge": Hinge("joint_3.slide", "joint_3", AXIS, revolute=False),
    "distal hinge off the axis": Hinge(
        "joint_3.tilt", "joint_3", AXIS, distal=True, offset=(0.1, -0.2, 0.3)
    ),
    "gear": Gear("joint_3.gear", "joint_3", (0.0, 1.0, 0.0)),
    "gear with friction": Gear(
        "joint_3.gear", "joint_3", (0.0, 1.0, 0.0), knees=(400.0, 1300.0), slips=(50.0, 150.0)
    ),
    "gear on a heavy arm": Gear(
        "joint_3.gear", "joint_3", (0.0, 1.0, 0.0), knees=(400.0, 1300.0), slips=(50.0, 150.0)
    ),
    "gear of plays on a heavy arm": Gear(
        "joint_3.gear",
        "joint_3",
        (0.0, 1.0, 0.0),
        knees=(400.0, 1300.0),
        slips=(50.0, 150.0),
        plays=True,
    ),
    "gear without friction on a heavy arm": Gear("joint_3.gear", "joint_3", (0.0, 1.0, 0.0)),
    "tensor": Tensor("joint_3.tensor", "joint_3"),
    "tensor off the origin": Tensor("joint_3.tensor", "joint_3", (0.1, -0.2, 0.3)),
}
"""Springs of each kind at joint 3."""
RNG = np.random.default_rng(5)
FORCE, MOMENT = RNG.normal(0.0, 800.0, (4, 3)), RNG.normal(0.0, 100.0, (4, 3))
MARKER = np.array([0.2, -0.3, 0.5])


@cache
def model(case: str) -> ElasticModel:
    """Return the arm with the spring between axial springs of the other joints."""
    arm = heavy_robot() if "heavy" in case else robot()
    others = [axial(joint) for joint in arm.chain.joints if joint.name != "joint_3"]
    return ElasticModel(arm, (*others[:2], CASES[case], *others[2:]))


def planted(case: str) -> np.ndarray:
    """Return parameters of sensible sizes, positive."""
    scales = np.array([parameter.scale for parameter in model(case).parameters])
    made = scales * np.random.default_rng(1).uniform(0.5, 2.0, len(scales))
    # What may be negative, as beside the diagonal of a tensor, stays small beside the rest.
    free = np.array([parameter.lower < 0.0 for parameter in model(case).parameters])
    return np.where(free, -0.2 * made, made)


def planted_of(spring: Spring) -> np.ndarray:
    return np.arange(1.0, 1.0 + len(spring.parameters)) * 1e-7


def calibrated(case: str) -> CalibratedModel:
    c = planted(case)
    draws = c * (1.0 + 0.1 * np.random.default_rng(2).normal(size=(50, len(c))))
    return CalibratedModel(model(case), c, draws, Observability(len(c), 1.0, (True,) * len(c), ()))


def test_every_kind_of_the_library_has_a_case():
    assert {type(spring) for spring in CASES.values()} == set(KINDS.values())


@pytest.mark.parametrize("case", CASES)
class TestEverySpring(SpringSuite):
    @pytest.fixture
    def spring(self, case) -> Spring:
        return CASES[case]

    def test_what_a_file_knows_of_it_is_one_number_or_a_data_sheet(self, case):
        """One number takes a stiffness, a gear K1 to K3, anything else says that it takes none."""
        spring = CASES[case]
        unit = "N*m/rad" if spring.axes[0].revolute else "N/m"
        number = Knowledge(stiffness=f"1e6 {unit}", uncertainty="20 %")
        sheet = Knowledge(
            K1="1 MN*m/rad", T1="100 N*m", K2="2 MN*m/rad", T2="1 kN*m", K3="3 MN*m/rad",
            uncertainty="20 %",
        )  # fmt: skip
        if len(spring.parameters) == 1:
            (known,) = number.of_spring(spring)
            assert (known.name, known.weights) == (spring.name, None)
        else:
            with pytest.raises(SpringError, match="numbers"):
                number.of_spring(spring)
        if not isinstance(spring, Gear):
            with pytest.raises(SpringError, match="is no gear"):
                sheet.of_spring(spring)
            return
        for known, low, high in zip(
            sheet.of_spring(spring), (0, 100, 1000), (100, 1000, 2000), strict=True
        ):
            load = SpringLoad((np.array(high - low, dtype=float),), (np.array(low, dtype=float),))
            turned = np.dot(np.array(spring.angles(load)[0], dtype=float), planted_of(spring))
            mean = np.dot(known.weights, planted_of(spring))
            assert mean == pytest.approx(turned / (high - low), rel=1e-12)

    def test_columns_are_finite_differences_of_the_deflection(self, case):
        """The chain by matrix products, its virtual joints turned by what the law says."""
        spring, arm = CASES[case], model(case)
        first = arm.parameter_names.index(spring.parameters[0].name)
        found = []
        expected = []
        qs = configurations(linkage(), 4)
        for q, f, m in zip(qs, FORCE, MOMENT, strict=True):
            J, W = zip(*(numerical_column(linkage(), q, axis) for axis in spring.axes), strict=True)
            torque = tuple(np.array(j @ f + w @ m) for j, w in zip(J, W, strict=True))
            # Pressed from rest: friction follows the torque until it slides.
            borne = tuple(np.clip(torque[0], -limit, limit) for limit in spring.friction_limits)
            weight = (
                tuple(arm.weight_torques(q)[2 : 2 + len(spring.axes)]) if arm.bears_weight else ()
            )
            angles = np.array(spring.angles(SpringLoad(torque, weight, borne)))
            expected.append(np.transpose(J) @ angles)
            columns = slice(first, first + len(spring.parameters))
            found.append(arm.observation_blocks(q, f, m)[:, columns])
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())

    def test_springs_of_one_law_together_are_what_each_is_alone(self, case):
        spring = CASES[case]
        springs = [
            replace(spring, name=name, joint=name) for name in ("joint_2", "joint_3", "joint_5")
        ]
        q = configurations(linkage(), 4)
        together = ElasticModel(robot(), springs).observation_blocks(q, FORCE, MOMENT)
        alone = [ElasticModel(robot(), [s]).observation_blocks(q, FORCE, MOMENT) for s in springs]
        np.testing.assert_allclose(together, np.concatenate(alone, axis=-1), rtol=1e-12, atol=1e-9)

    def test_cartesian_compliance_is_the_derivative_of_the_deflection_by_the_load(self, case):
        """Of the tcp, and of a marker beside it, which a rotation moves as well."""
        arm, c = model(case), planted(case)
        q, f, m = configurations(linkage(), 1)[0], FORCE[0], MOMENT[0]
        found = arm.cartesian_compliance(c, q, f, m)
        lever = arm.robot.forward(q)[:3, :3] @ MARKER
        for step, column, coupled, turned in zip(
            np.eye(3), found.translation.T, found.coupling.T, found.rotation.T, strict=True
        ):
            by_force = (arm.deflection(c, q, f + step, m) - arm.deflection(c, q, f - step, m)) / 2.0
            np.testing.assert_allclose(column, by_force, rtol=1e-4, atol=1e-12)
            ahead, behind = (
                np.array([arm.deflection(c, q, f, m + by), blocks @ c])
                for by in (step, -step)
                for blocks in [arm.observation_blocks(q, f, m + by, MARKER)]
            )
            at_tcp, at_marker = (ahead - behind) / 2.0
            np.testing.assert_allclose(coupled, at_tcp, rtol=1e-4, atol=1e-12)
            np.testing.assert_allclose(
                coupled + np.cross(turned, lever), at_marker, rtol=1e-4, atol=1e-12
            )

    def test_directional_rows_are_the_compliance_without_load_along_a_direction(self, case):
        arm, c, u = model(case), planted(case), np.array([0.6, 0.0, -0.8])
        q = configurations(linkage(), 6).reshape(2, 3, -1)
        C = arm.cartesian_compliance(c, q).translation
        np.testing.assert_allclose(arm.directional_rows(q, u) @ c, u @ C @ u, rtol=1e-10)

    def test_a_planted_truth_comes_back_exactly_from_exact_readings(self, case):
        arm, truth = model(case), planted(case)
        readings = campaign()
        exact = displacement_blocks(arm, readings) @ truth
        readings = replace(readings, marker_displacement=readings.controller_displacement + exact)
        found = solve(build(arm, readings)).compliance
        np.testing.assert_allclose(displacement_blocks(arm, readings) @ found, exact, atol=1e-9)
        np.testing.assert_allclose(found, truth, rtol=1e-5)

    @pytest.mark.slow
    def test_it_comes_back_from_noisy_readings_with_a_blunder(self, case):
        arm, truth = model(case), planted(case)
        readings = campaign()
        exact = displacement_blocks(arm, readings) @ truth
        rng = np.random.default_rng(3)
        marker = readings.controller_displacement + exact + 1e-5 * rng.normal(size=exact.shape)
        marker[20, 1] += 0.5
        readings = replace(readings, marker_displacement=marker)
        found = calibrate(arm, readings, np.random.default_rng(0))
        assert np.flatnonzero(~found.used).tolist() == [20]
        predicted = found.calibrated.predict(readings.joint_position, readings.force)
        exact = arm.deflection(truth, readings.joint_position, readings.force)
        error = np.linalg.norm(predicted.deflection - exact, axis=1)
        assert error.max() < 1e-5
        inside = (predicted.low <= exact) & (exact <= predicted.high)
        assert inside.mean() > 0.5

    def test_names_make_statements_that_equal_the_model(self, case):
        """Load cases, each pressed from rest, and a whole step of the online compensator."""
        numbers = design(calibrated(case))
        functions, arm = numbers.functions(), model(case)
        size = 3 * len(arm.parameters)
        for q, f, m in zip(configurations(linkage(), 4), FORCE, MOMENT, strict=True):
            free = [functions.rest(q.tolist())] if len(arm.friction) else []
            row = q.tolist(), f.tolist(), m.tolist(), *free
            expected = arm.deflection(planted(case), q, f, m)
            np.testing.assert_allclose(functions.deflection(*row)[:3], expected, rtol=1e-10)
            block = np.reshape(functions.block(*row)[:size], (3, -1))
            expected = arm.observation_blocks(q, f, m)
            np.testing.assert_allclose(block, expected, atol=1e-12 * np.abs(expected).max())
        compensator = Compensator(numbers)
        q = configurations(linkage(), 1)[0]
        R = robot().forward(q)[:3, :3]
        reading = Reading(0.004, q.tolist(), (R.T @ FORCE[0]).tolist(), [0.0] * 3)
        _, corrected = compensator.step(compensator.start(), reading)
        assert np.all(np.isfinite(corrected.deflection))

    @needs_gcc
    def test_exported_c_equals_python(self, case, tmp_path):
        executable = compiled_c(written(tmp_path, design(calibrated(case))), "-O1")
        assert executable.selftest() == 0
        # One row after the other at one pose, as friction remembers them.
        arm, q = model(case), np.repeat(configurations(linkage(), 1), 4, axis=0)
        found = executable.numbers("loads", np.hstack([q, FORCE, MOMENT]))[:, :3]
        weight = arm.weight_torques(q)
        total = weight + arm.load_torques(q, FORCE, MOMENT)
        friction = arm.friction.path(np.concatenate([weight[:1], total]))[1:]
        expected = arm.deflection(planted(case), q, FORCE, MOMENT, friction)
        np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("case", CASES)
def test_a_model_file_gives_the_same_class_back(case, tmp_path):
    write_model(tmp_path / "model.json", calibrated(case))
    found = read_model(tmp_path / "model.json")
    assert found.model.springs == model(case).springs
    assert [type(spring) for spring in found.model.springs] == [
        type(spring) for spring in model(case).springs
    ]
    np.testing.assert_array_equal(found.compliance, planted(case))


def test_hinges_are_what_a_file_means_that_names_no_kind(tmp_path):
    write_model(tmp_path / "model.json", calibrated("hinge"))
    text = (tmp_path / "model.json").read_text()
    assert '"kind"' not in text
    name = '"name": "joint_3.x"'
    assert name in text
    (tmp_path / "odd.json").write_text(text.replace(name, f'"kind": "odd", {name}'))
    with pytest.raises(SchemaError, match=r"springs\.2: unknown kind of spring 'odd' \(allowed: h"):
        read_model(tmp_path / "odd.json")


def test_a_spring_of_a_file_that_is_none_is_refused(tmp_path):
    write_model(tmp_path / "model.json", calibrated("hinge"))
    data = json.loads((tmp_path / "model.json").read_text())
    data["springs"][2] = "joint_3.x"
    (tmp_path / "model.json").write_text(json.dumps(data))
    with pytest.raises(SchemaError, match=r"springs\.2"):
        read_model(tmp_path / "model.json")


def test_a_unit_that_no_kind_has_is_shown_as_the_file_states_it():
    assert unit_of("m/(N*m)") == Unit("m/(N*m)", "m/(N*m)", 1.0, "")
