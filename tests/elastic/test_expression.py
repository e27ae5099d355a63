import numpy as np
import pytest

from elastocal.compensation.kernel import Call
from elastocal.compensation.kernel._statics import written
from elastocal.compensation.kernel.program import Program, Value
from elastocal.elastic.springs import Expression, Function, Input, Number, Product, Sum, atan2

X, Y = Input("x"), Input("y")


def law(x, y):
    whole = (2.0 * x - y / 4.0 + 1.0) * -x + (3.0 - atan2(x * y, x)) + (0.5 + atan2(1.0, y))
    return whole / (x * x + 2.0) - 3.0 / (y - 1.0)


def evaluated(formula: Expression, values: dict[str, float]) -> float:
    match formula:
        case Input(name):
            return values[name]
        case Number(value):
            return value
        case Sum(terms):
            return sum(evaluated(term, values) for term in terms)
        case Product(factors):
            return float(np.prod([evaluated(factor, values) for factor in factors]))
        case Function("atan2", (y, x)):
            return float(np.arctan2(evaluated(y, values), evaluated(x, values)))
        case Function("quotient", (over, under)):
            return evaluated(over, values) / evaluated(under, values)
    raise AssertionError(formula)


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (1.5, -2.0), (-300.0, 0.25)])
def test_a_law_of_names_is_the_law_of_numbers(x, y):
    expected = law(np.array(x), np.array(y))
    assert evaluated(law(X, Y), {"x": x, "y": y}) == pytest.approx(float(expected), rel=1e-14)


def test_statements_of_a_formula_are_sums_of_products_and_calls():
    program = Program()
    names = iter(["a", "b", "c", "d"])
    found = written(program, atan2(X * Y, X), {"x": Value(1, "q1"), "y": Value(-1, "q2")}, names)
    assert found == Value(1, "a")
    assert program.statements[-1] == Call("a", "atan2", (Value(1, "b"), Value(1, "q1")))


def test_a_small_number_of_a_law_is_not_taken_for_zero():
    program = Program()
    found = written(program, 1e-17 * X, {"x": Value(1, "q1")}, iter("abc"))
    assert found.sign == 1
    assert 1e-17 in program.constants.values()
