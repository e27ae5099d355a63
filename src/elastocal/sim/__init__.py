"""Simulated truth. Only the composition roots and the tests may import it.

It is made by other equations than the estimator's: no Pinocchio, no `elastocal.elastic`.

============  =================================================================================
`arm`         elastic arms: linkage, springs, least potential energy, and what Procedure 1 of the
              paper records on them
`workcell`    a whole cell in time: robot controller, force sensor, tracker, clock, faults
`wire`        the cell speaking as controllers, sensors and trackers do, over sockets
`truth`       the sections `simulation` and `faults` of the cell file; their `presets`
`driver`      the simulated devices, as `elastocal.workflows.run` finds them
============  =================================================================================
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
