"""Contract suites for pytest, for variants of elastocal and of other packages.

A suite is a class of tests. Make a subclass whose name begins with ``Test`` and give it the fixture
that says what is tested:

    class TestSoftening(SpringSuite):
        @pytest.fixture(params=[Softening("joint_2.soft", "joint_2", (1.0, 0.0, 0.0))])
        def spring(self, request):
            return request.param
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
