"""Simulated truth. Only the composition roots and the tests may import it.

It is made by other equations than the estimator's: no Pinocchio, no `elastocal.elastic`.

============  =================================================================================
`arm`         elastic arms: linkage, springs, least potential energy, and what Procedure 1 of the
              paper records on them
`workcell`    a whole cell in time: robot controller, force sensor, tracker, clock, faults
============  =================================================================================
"""
