"""Springs: the elastic elements of a robot, one file a kind.

A kind is a subclass of `Spring` with its place in the chain, its parameters, its law (the angle
that a torque makes) and the tangent of that. Identification, prediction, tables, model files, the
online compensator and the C export follow from these. A new kind is a file here, an entry in the
face and in `KINDS`, and one in ``tests/contracts/test_springs.py``.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
