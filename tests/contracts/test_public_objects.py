"""Every public class: shows itself in a few lines, whatever it holds."""

import dataclasses
import importlib
import re
import sys
import typing
from pathlib import Path

import numpy as np
import pytest

from elastocal.codec.study import Sample
from elastocal.elastic import ElasticModel, layout
from elastocal.identification import CalibrateResult, calibrate
from elastocal.results import MOST_CHARACTERS, MOST_LINES
from support import cells, codecs, compensated, datasets, plans, studies, tooling

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tools"))

import house  # noqa: E402 - it lives beside the sources, not among them

_MANY = re.compile(
    r"Array|ndarray|Mapping|Sequence|Collection|\b(dict|list|frozenset)\b|, \.\.\.\]"
)
"""Types whose values may be long."""
_FILES = ("urdf", "cell_text")
"""Fields that hold the text of a whole file."""


def _public_dataclasses() -> list[type]:
    found = {}
    for names in house.find_faces(house.find_modules(ROOT / "src")).values():
        for name, source in names.items():
            thing = getattr(importlib.import_module(source), name, None)
            if isinstance(thing, type) and dataclasses.is_dataclass(thing):
                found[f"{thing.__module__}.{thing.__qualname__}"] = thing
    return [cls for name, cls in sorted(found.items()) if name.startswith("elastocal.")]


def _lists_its_fields(cls: type) -> bool:
    """Return whether a class has the representation that `dataclasses` makes."""
    return hasattr(cls.__repr__, "__wrapped__")


def _may_be_long(cls: type) -> list[str]:
    hints = typing.get_type_hints(cls)
    return [
        each.name
        for each in dataclasses.fields(cls)
        if each.repr and (_MANY.search(str(hints[each.name])) or each.name in _FILES)
    ]


def test_no_public_dataclass_that_may_be_long_lists_its_fields():
    public = _public_dataclasses()
    long = {cls.__qualname__: _may_be_long(cls) for cls in public if _lists_its_fields(cls)}
    assert not {name: fields for name, fields in long.items() if fields}, "mark it `brief_repr`"


@pytest.fixture(scope="module")
def instances():
    model = ElasticModel(cells.robot(), layout(cells.robot(), "bearing"))
    readings = cells.Cell(cells.linear_truth(), poses=8).readings()
    found = calibrate(model, readings, np.random.default_rng(0))
    plan, pool, codec = plans.plan(), plans.pool(), codecs.judged()
    calibrated = found.calibrated
    return (
        *(model, model.robot, model.springs[0], readings, found, calibrated),
        calibrated.predict(readings.joint_position, readings.force),
        *(calibrated.observability, CalibrateResult.of(calibrated), datasets.dataset()),
        *(plan, plan.robot, plan.poses[0], plan.search, pool, tooling.cap()),
        *(codec.data, codec.verdicts, codec.insight, compensated.load()),
        *(studies.settings(), studies.simulate(Sample(3, 0))),
    )


def test_an_object_shows_itself_in_a_few_lines(instances):
    for each in instances:
        text = repr(each)
        assert len(text.splitlines()) <= MOST_LINES, text
        assert len(text) <= MOST_CHARACTERS, text
        assert not re.search(r"<robot|array\(\[| object at 0x", text), text
