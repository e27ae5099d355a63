"""What every section of the report keeps: it copes with every subset of the parts."""

from itertools import combinations

import pytest

from elastocal.report.document.page import ordered_sections
from elastocal.report.pages import templating, view_data
from elastocal.report.pages.templating import embedded
from elastocal.testing import SectionSuite
from elastocal.testing.sections import PARTS, parts_only, sound_page
from elastocal.verdict import (
    EvidenceOptions,
    find_everything,
    gather_evidence,
)
from support import reported

NAMES = list(PARTS)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """All parts, an earlier calibration among them."""
    from support.cli import elastocal

    folder = reported.finished()
    old = tmp_path_factory.mktemp("old") / "old.json"
    data = folder / "run" / "dataset.nc"
    made = elastocal("calibrate", data, "--out", old, "--exclude", 0, "--draws", 40)
    assert made.code == 0, made.err
    parts = gather_evidence(EvidenceOptions(folder, old=old), reported.MADE)
    # Days of measurement are read from imported logs alone.
    needed = {name: empty for name, empty in PARTS.items() if name != "measured"}
    assert all(getattr(parts, name) != empty for name, empty in needed.items())
    return parts


def check(section, evidence):
    content = section.body(evidence)
    sound_page(section, evidence)
    if content.scene is not None:
        scene = content.scene
        embedded(view_data(scene.view, scene.plan, scene.pool))


@pytest.mark.parametrize("section", ordered_sections(), ids=lambda section: section.identifier)
class TestEverySection(SectionSuite):
    @pytest.fixture
    def evidence(self, whole):
        return whole

    def test_its_scene_can_be_embedded(self, section, whole):
        check(section, whole)

    @pytest.mark.slow
    def test_it_copes_with_two_parts_and_without_two(self, section, whole, monkeypatch):
        monkeypatch.setattr(templating, "themed_svg", lambda *_: b"")
        for few in combinations(NAMES, 2):
            check(section, parts_only(whole, few))
            check(section, parts_only(whole, set(NAMES) - set(few)))


def test_findings_cope_with_up_to_two_parts_and_without_up_to_two(whole):
    for few in (*combinations(NAMES, 1), *combinations(NAMES, 2)):
        for parts in (parts_only(whole, few), parts_only(whole, set(NAMES) - set(few))):
            for finding in find_everything(parts):
                assert finding == finding.strip() != ""
