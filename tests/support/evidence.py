"""Fixtures of tests that need the evidence of a whole run."""

import pytest

from elastocal.verdict import (
    Evidence,
    EvidenceOptions,
    gather_evidence,
)
from support import reported


@pytest.fixture(scope="session")
def finished():
    """A folder with everything that a report is made from; shared, not to be changed."""
    return reported.finished()


@pytest.fixture(scope="session")
def parts(finished) -> Evidence:
    return gather_evidence(EvidenceOptions(finished), reported.MADE)


@pytest.fixture
def copied(finished, tmp_path):
    """Return a function that copies some of it (all by default) into a folder of the test's own."""

    def copy(*names):
        return reported.copied(finished, tmp_path / "all", *names)

    return copy
