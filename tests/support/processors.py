"""The processors whose rounding a suite imitates: OpenBLAS chooses its kernels by what it is told.

Of several processes each takes another, the first the machine's own: every suite sees three, and
which test meets which changes from run to run. With ``OPENBLAS_CORETYPE`` set all take that one.
"""

import os
import platform
import sys

CORE_TYPES = ("", "Haswell", "Prescott", "Zen", "Sandybridge")
_SETTING = "OPENBLAS_CORETYPE"


def imitate_one() -> str:
    """Let this process, and those that it starts, round as one of the processors; return its name.

    To be called before NumPy is imported.
    """
    worker = os.environ.get("PYTEST_XDIST_WORKER", "").removeprefix("gw")
    if worker and platform.machine() == "x86_64" and _SETTING not in os.environ:
        if "numpy" in sys.modules:
            raise RuntimeError("NumPy has chosen its kernels already")
        os.environ[_SETTING] = CORE_TYPES[int(worker) % len(CORE_TYPES)]
    return os.environ.get(_SETTING, "")
