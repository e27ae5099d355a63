"""Variants: names, combinations, refusals that list what is known."""

import dataclasses

import pytest

from elastocal.codec import Variant, make_variants, training_cases
from elastocal.codec.variants import check_different, read_comparison
from elastocal.errors import CodecError, DatasetError, PlanningError


def test_nothing_to_compare_is_the_default_alone():
    assert make_variants({}) == (Variant("default", "cover", "auto", "all", "bounded"),)


def test_one_key_names_variants_after_its_values():
    made = make_variants({"springs": ("actuated", "bearing")})
    assert [each.name for each in made] == ["actuated", "bearing"]
    assert [each.springs for each in made] == ["actuated", "bearing"]


def test_several_keys_give_every_combination():
    made = make_variants({"search": ("cover", "ioops"), "load_cases": ("normal", "all")})
    assert [each.name for each in made] == [
        "cover, normal", "cover, all", "ioops, normal", "ioops, all",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("serch=cover,ioops", "unknown key 'serch'; did you mean 'search'"),
        ("search", "KEY=A,B"),
        ("search=cover,", "KEY=A,B"),
        ("search=cover,cover", "different values"),
        ("", "unknown key ''"),
    ],
)
def test_a_comparison_that_does_not_fit_is_refused(text, words):
    with pytest.raises(CodecError, match=words):
        read_comparison(text)


def test_an_unknown_technique_is_refused_with_the_known_ones():
    with pytest.raises(PlanningError, match=r"'iops'; did you mean 'ioops'\? \(allowed: cover, "):
        make_variants({"search": ("cover", "iops")})


def test_an_unknown_solver_is_refused_with_the_known_ones():
    with pytest.raises(CodecError, match=r"'bound'.*\(allowed: bounded, unbounded, huber, cauchy"):
        Variant(solver="bound")


def test_a_load_case_that_the_dataset_lacks_is_refused_with_those_it_has():
    with pytest.raises(DatasetError, match=r"'nort'.*mean 'north'.*known: normal, north, or all"):
        training_cases("normal+nort", ["normal", "north"])


def test_a_load_case_may_be_called_as_it_likes():
    assert training_cases("all", ["all", "pull"]) == ("all",)
    assert training_cases("a+b", ["a+b", "a"]) == ("a+b",)
    assert training_cases("all", ["pull", "push"]) == ("pull", "push")


@pytest.mark.parametrize("other", ["normal+north", "north+normal", "all"])
def test_two_names_of_one_variant_are_refused(other):
    variants = make_variants({"load_cases": ("normal+north", other)})
    variants = (variants[0], dataclasses.replace(variants[1], name="other"))
    with pytest.raises(CodecError, match="'normal\\+north' and 'other' are the same"):
        check_different(variants, ("normal", "north"))


def test_variants_that_differ_are_let_through():
    check_different(make_variants({"load_cases": ("all", "normal")}), ("normal", "north"))


def test_a_load_case_that_stands_twice_is_refused():
    with pytest.raises(DatasetError, match="stands twice"):
        training_cases("normal+normal", ("normal", "north"))
