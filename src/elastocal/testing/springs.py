"""Contract of every kind of spring without a robot: parameters, law, tangents, files."""

from dataclasses import replace

import numpy as np

from elastocal.elastic import KINDS, Spring, SpringLoad, unit_of
from elastocal.elastic.springs import Input
from elastocal.records import from_data, to_data


class SpringSuite:
    """Tests of a spring, the fixture ``spring``."""

    def test_its_class_is_found_by_the_word_that_files_have_for_it(self, spring: Spring) -> None:
        word = to_data(spring).get("kind", "hinge")
        assert word in KINDS, (
            f"no package has the entry point {word!r} in elastocal.springs: is yours installed, and"
            " is that the word of its field kind?"
        )
        assert KINDS[word] is type(spring)

    def test_parameters_have_names_units_scales_and_bounds(self, spring: Spring) -> None:
        names = [parameter.name for parameter in spring.parameters]
        assert len(set(names)) == len(names)
        if len(names) == 1:
            assert names == [spring.name]
        for parameter in spring.parameters:
            assert parameter.name.startswith(spring.name)
            assert parameter.joint == spring.joint
            assert parameter.unit in spring.units
            assert unit_of(parameter.unit.si) == parameter.unit
            assert parameter.unit.shown
            assert parameter.unit.factor > 0.0
            assert parameter.lower < parameter.scale < np.inf

    def test_it_is_a_value(self, spring: Spring) -> None:
        assert spring == replace(spring)
        assert hash(spring) == hash(replace(spring))
        assert spring != replace(spring, name="other")

    def test_tangents_are_finite_differences_of_the_law_and_symmetric(self, spring: Spring) -> None:
        n = len(spring.axes)
        for torque in np.random.default_rng(4).normal(0.0, 500.0, (5, n)):
            found = np.array(spring.tangents(SpringLoad(tuple(torque))), dtype=float)
            for other, step in enumerate(1e-2 * np.eye(n)):
                ahead, behind = (
                    np.array(spring.angles(SpringLoad(tuple(torque + by)))) for by in (step, -step)
                )
                slope = (ahead - behind) / 2e-2
                np.testing.assert_allclose(found[:, other], slope, rtol=1e-6, atol=1e-8)
            np.testing.assert_allclose(found, np.swapaxes(found, 0, 1))

    def test_it_is_the_same_after_a_file(self, spring: Spring) -> None:
        assert from_data(type(spring), to_data(spring), "a file") == spring

    def test_the_law_of_names_has_a_row_an_axis_and_an_entry_a_parameter(
        self, spring: Spring
    ) -> None:
        names = tuple(Input(f"t{k}") for k in range(len(spring.axes)))
        rows = spring.angles(SpringLoad(names))
        assert [len(row) for row in rows] == [len(spring.parameters)] * len(spring.axes)
