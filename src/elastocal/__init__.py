"""elastocal: in-situ elastic calibration of industrial robots.

The method is that of Monsarrat et al., "In-situ elastic calibration of robots", Robotics and
Computer-Integrated Manufacturing (2024), doi:10.1016/j.rcim.2024.102743, called *the paper*
throughout. The usual way in::

    import elastocal as ec

    result = ec.calibrate("dataset.nc")
    result.plot()

The work of every command is a function here; equations and parts are in the subpackages.
Nothing is imported before it is used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
