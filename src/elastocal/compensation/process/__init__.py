"""A process path in closed loop, without and with correction: the paper's Table 1.

=============  ====================================================================
`course`       a stretch of path under force, by time; what a process is
`placement`    fibre placement courses on a dome (paper 4.2)
`roughing`     rings of a dome roughed from a block (paper 4.3)
`postures`     the processes by name; one spin and rail position for their courses
`programmed`   the path as a file: written, and a user's own courses read
`loop`         cycle by cycle: readings, corrector, delay, deviation
`statistics`   mean, max and standard deviation; reduction: the lines of Table 1
`result`       Table 1 with what it rests on, and its folder
=============  ====================================================================

Nothing here knows what the cell truly does: it comes in as a `loop.TrueCell`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
