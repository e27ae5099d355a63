"""Compensation of the predicted deflection: online, offline, and on a real-time target.

================  ================================================================
`settings`        settings of a compensator, as in its file
`conditioning`    from the raw wrench to the wrench at the tcp: tool, bias, filters
`online`          the correction of a cycle, from joints and readings
`kernel`          the statements that Python and C both run
`export`          C99 of a compensator
`offline`         a programmed path corrected: read, solve, write
`programs`        programs of robot controllers corrected, such as KUKA's
`posture_survey`  every posture along a path, and how stiff it is (paper 4.3.1)
`posture_choice`  the stiffest of them
`process`         a simulated process without and with correction (paper, Table 1)
================  ================================================================

A new filter goes into `conditioning.filters`, a new controller beside `programs.krl`, a new
process beside `process.placement`; each of these names the other places to change.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
