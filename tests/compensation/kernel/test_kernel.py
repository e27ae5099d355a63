import numpy as np
import pytest

from contracts.test_layouts import CASES
from elastocal.compensation.kernel import (
    Assignment,
    Remark,
    compiled,
    deflection,
    observation_block,
    orientation,
    sum_text,
    value_text,
)
from elastocal.compensation.kernel.functions import python_text
from elastocal.compensation.kernel.program import ONE, ZERO, Program, Value, needed
from elastocal.elastic import ElasticModel
from elastocal.robot import Robot
from support.virtual_chain import ARMS


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("case", CASES)
class TestEveryArmAndLayout:
    @pytest.fixture
    def model(self, arm, case):
        robot = Robot.from_urdf(ARMS[arm], "tcp")
        return ElasticModel(robot, CASES[case](robot))

    def states(self, model, count=3):
        rng, n = np.random.default_rng(3), len(model.robot.joint_names)
        return zip(
            rng.uniform(-2.0, 2.0, (count, n)),
            1e3 * rng.normal(size=(count, 3)),
            1e2 * rng.normal(size=(count, 3)),
            strict=True,
        )

    def test_deflection_is_that_of_the_model(self, model):
        c = np.random.default_rng(0).uniform(0.0, 1e-6, len(model.springs))
        routine = compiled(deflection(model, c.tolist()), len(model.robot.joint_names))
        for q, f, m in self.states(model):
            expected = model.deflection(c, q, f, m)
            found = routine(q.tolist(), f.tolist(), m.tolist())
            np.testing.assert_allclose(found, expected, atol=1e-13 * np.linalg.norm(expected))

    def test_block_is_that_of_the_model(self, model):
        routine = compiled(observation_block(model), len(model.robot.joint_names))
        for q, f, m in self.states(model):
            expected = model.observation_blocks(q, f, m)
            found = np.reshape(routine(q.tolist(), f.tolist(), m.tolist()), expected.shape)
            np.testing.assert_allclose(found, expected, atol=1e-13 * np.abs(expected).max())

    def test_orientation_is_that_of_the_robot(self, model):
        routine = compiled(orientation(model), len(model.robot.joint_names), loaded=False)
        for q, *_ in self.states(model):
            found = np.reshape(routine(q.tolist()), (3, 3))
            np.testing.assert_allclose(found, model.robot.forward(q)[:3, :3], atol=1e-14)


class TestProgram:
    def test_products_with_zero_and_one_are_left_out(self):
        program, a = Program(), Value(1, "a")
        assert program.total("x", [(a, ZERO), (ONE, a)]) == a
        assert program.statements == []

    def test_signs_go_through_products(self):
        program, a, b = Program(), Value(-1, "a"), Value(1, "b")
        program.total("x", [(a, b), (-a, -b), (-ONE,)])
        assert program.statements == [
            Assignment("x", ((-1, ("a", "b")), (-1, ("a", "b")), (-1, ())))
        ]

    def test_a_right_angle_that_is_not_quite_one_is_one(self):
        program = Program()
        assert program.constant("a", np.cos(np.pi / 2)) == ZERO
        assert program.constant("b", np.sin(np.pi / 2)) == ONE
        assert program.constants == {}

    def test_a_quantity_keeps_its_name_at_zero(self):
        program = Program()
        assert program.quantity("compliance1", 0.0) == Value(1, "compliance1")
        assert program.constants == {"compliance1": 0.0}

    def test_statements_that_nothing_needs_are_dropped_with_their_remark(self):
        program, a, b = Program(), Value(1, "a"), Value(1, "b")
        program.remark("idle")
        program.total("x", [(a, b)])
        program.remark("used")
        y = program.total("y", [(a, a)])
        assert needed(program.statements, [y]) == (
            Remark("used"),
            Assignment("y", ((1, ("a", "a")),)),
        )

    @pytest.mark.parametrize(
        ("terms", "text"),
        [
            (((-1, ("a", "b")), (1, ("c",)), (-1, ("d", "e"))), "-(a * b) + c - (d * e)"),
            (((1, ("a", "b")), (1, ())), "(a * b) + 1.0"),
            (((1, ("a", "b")),), "a * b"),
            (((-1, ("a", "b")),), "-(a * b)"),
        ],
    )
    def test_a_sum_reads_left_to_right_with_its_products_in_parentheses(self, terms, text):
        assert sum_text(Assignment("x", terms)) == text

    @pytest.mark.parametrize(
        ("value", "text"), [(ZERO, "0.0"), (-ONE, "-1.0"), (Value(-1, "a"), "-a")]
    )
    def test_a_value_by_itself(self, value, text):
        assert value_text(value) == text


def test_names_of_a_description_never_reach_the_source():
    urdf = ARMS["one joint"].replace('<joint name="', '<joint name="__import__(1) ')
    robot = Robot.from_urdf(urdf, "tcp")
    model = ElasticModel(robot, CASES["bearing"](robot))
    assert any("import" in name for name in robot.joint_names)
    assert "import" not in python_text(deflection(model, [1e-6] * 3), 1, loaded=True)
