"""Codecs of campaigns in which the tooling, not a tracker, held the tool."""

import numpy as np
import pytest

import elastocal as ec
from elastocal.codec import read_codec
from elastocal.errors import IdentificationError
from elastocal.identification import Contact
from support.held import STIFFNESS, Held, held_by_contact

pytestmark = pytest.mark.slow

STATED = Contact(normal=5e6, lateral=3e6)


def codec(how, out, contact=STATED, springs="actuated", **options):
    compare = f"springs={springs}"
    return ec.codec(
        held_by_contact(how), out=out, contact=contact, compare=compare, splits=3, jobs=1, **options
    )


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Return a codec of ten places without a tracker, and its folder."""
    out = tmp_path_factory.mktemp("codec") / "codec"
    return codec(Held(poses=10), out, springs="actuated,bearing"), out


def test_training_sets_find_the_springs_behind_the_contact(found):
    data = found[0].data
    # Seven of ten poses in each split, and the contact is stated.
    last = data.compliance[0][:, -1]
    assert last.shape == (3, len(STIFFNESS))
    np.testing.assert_allclose(last, np.tile(1.0 / STIFFNESS, (3, 1)), rtol=0.05)
    assert np.median(data.errors("actuated")[:, -1]) < 0.01 * np.median(data.zero_error)


def test_springs_that_the_stated_contact_tells_apart_are_determined(found):
    (actuated, _) = found[0].analysis.seen
    assert actuated.determined.shape[-1] == len(STIFFNESS)
    assert actuated.share[-1].tolist() == [1.0] * len(STIFFNESS)


def test_the_folder_knows_the_contact(found):
    result, out = found
    kept = read_codec(out).options.contact
    assert (kept.normal, kept.lateral) == (STATED.normal, STATED.lateral)
    assert kept == result.data.options.contact
    assert [each.kind for each in result.summary.findings] == ["codec.held-by-contact"]


def test_a_free_normal_leaves_gears_out_by_name(tmp_path):
    with pytest.raises(IdentificationError, match=r"gears were not tried: contact.normal is free"):
        codec(Held(poses=8), tmp_path / "gears", Contact(), "gears")
    loose = codec(Held(poses=8), tmp_path / "codec", Contact())
    assert {
        each.values["springs"] for each in loose.summary.findings if "springs" in each.values
    } >= {"gears", "links"}


def test_without_a_contact_such_readings_are_refused(tmp_path):
    with pytest.raises(IdentificationError, match=r"--contact CONTACT.yaml"):
        codec(Held(poses=6), tmp_path / "codec", None)
