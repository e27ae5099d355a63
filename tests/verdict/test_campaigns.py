"""A model of several campaigns: all its readings count, and each is made again where it can be."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from elastocal import workflows
from elastocal.dataset import read, write
from elastocal.verdict import EvidenceOptions, LinkState, gather_evidence
from support.reported import MADE, POSES


@pytest.fixture(scope="module")
def two(finished, tmp_path_factory):
    """Return a run, a model of it and of another table with other noise, and the other's path."""
    folder = tmp_path_factory.mktemp("two")
    shutil.copytree(finished / "run", folder / "run")
    own = folder / "run" / "dataset.nc"
    data, rng = read(own), np.random.default_rng(1)
    xyz = data.to_xarray().copy(deep=True)
    xyz["marker_displacement"] += 5e-6 * rng.standard_normal(xyz["marker_displacement"].shape)
    other = folder / "later" / "table.nc"
    other.parent.mkdir()
    write(replace(type(data).from_xarray(xyz)), other)
    workflows.calibrate((own, other), out=folder / "model.json", draws=40, springs="bearing")
    return folder, other


def gathered(folder):
    return gather_evidence(EvidenceOptions(folder / "run", model=folder / "model.json"), MADE)


@pytest.mark.slow
def test_the_errors_are_those_of_all_campaigns(two):
    folder, other = two
    found = gathered(folder)
    assert [each.path for each in found.campaigns] == [other]
    assert found.unseen.poses == 2 * POSES
    assert len(found.dataset.poses) == POSES
    assert found.reproduction.same
    texts = {(link.name, link.state): link.text for link in found.chain}
    assert "2 datasets" in texts["model", LinkState.WHOLE]
    assert "lies in no folder of a run" in texts["dataset", LinkState.UNSTATED]
    assert not any(state is LinkState.BROKEN for _, state in texts)


def test_a_codec_of_some_of_the_readings_does_not_count(two, finished):
    folder, _ = two
    shutil.copytree(finished / "codec", folder / "codec")
    found = gathered(folder)
    shutil.rmtree(folder / "codec")
    assert found.codecs == ()
    missing = {each.name: each.reason for each in found.missing}
    assert "other readings than the 2 datasets of the model" in missing["codec"]


def test_a_campaign_that_is_gone_or_changed_is_not_taken(two):
    folder, other = two
    kept = other.read_bytes()
    other.unlink()
    gone = gathered(folder)
    other.write_bytes(kept)
    assert (gone.campaigns, gone.merged) == ((), None)
    assert any("only one is here" in link.text for link in gone.chain)
