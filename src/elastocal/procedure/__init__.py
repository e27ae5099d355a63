"""Procedure 1 (paper 2.2): press at every pose of a plan, record it, derive the dataset.

Data flow in one direction: `run` drives the devices and, through `record`, writes a journal and raw
streams; `derive` reads those, with `registration` for the tracker stations, and writes the dataset
and the summary. So a newer program can derive a run again at any time.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
