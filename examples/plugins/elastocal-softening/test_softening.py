"""The spring keeps what every spring keeps."""

import pytest
from elastocal_softening import Softening

from elastocal.testing import SpringSuite


class TestSoftening(SpringSuite):
    @pytest.fixture(params=[1000.0, 250.0])
    def spring(self, request):
        return Softening("joint_2.soft", "joint_2", (1.0, 0.0, 0.0), opening=request.param)


def test_it_yields_the_more_the_harder_it_is_pressed():
    from elastocal.elastic import SpringLoad

    spring = Softening("joint_2.soft", "joint_2", (1.0, 0.0, 0.0))
    assert spring.tangents(SpringLoad((500.0,)))[0][0][1] == pytest.approx(0.75)
