"""The work of every command as one function: settings and progress in, a typed result out.

Each takes its settings record, or the first of its fields and the others by name:

    result = calibrate(CalibrateSettings(data="dataset.nc", springs="actuated"))
    result = calibrate("dataset.nc", springs="actuated")

Nothing is printed; files are written where the settings say so.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
