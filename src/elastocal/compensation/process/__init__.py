"""A process path in closed loop, without and with correction: the paper's Table 1.

=============  ====================================================================
`course`       a stretch of path under force, by time
`placement`    fibre placement courses on a dome (paper 4.2)
`roughing`     rings of a dome roughed from a block (paper 4.3)
`posture`      one spin and one rail position that the robot can follow
`variation`    forces that change slowly, and how they begin and end
`correctors`   what corrects: the online compensator, or a perfect one with delay
`loop`         cycle by cycle: readings, correction, delay, deviation
`table`        mean, max and standard deviation; reduction
`trace`        a course at every cycle: place, deviation before and after
`record`       what it has come to, as a folder keeps it
`deviations`   the traces in a CSV
`folder`       written and read: `read_process`, `write_process`
=============  ====================================================================

Nothing here knows what the cell truly does: it comes in as a `loop.TrueCell`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
