"""The criterion keeps what every criterion keeps, and so does the search by it."""

import pytest
from elastocal_trace import TOptimal

from elastocal.planning.search import technique
from elastocal.testing import CriterionSuite, TechniqueSuite


class TestTOptimal(CriterionSuite):
    @pytest.fixture
    def kind(self):
        return TOptimal


class TestExchangeByIt(TechniqueSuite):
    @pytest.fixture
    def searcher(self):
        return technique("exchange-t")
