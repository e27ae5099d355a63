"""Protocols of the devices that Procedure 1 needs; simulators and drivers implement them.

No call may take longer than a supervision cycle (``procedure.cycle``, 40 ms): the watchdog that
calls is the same that stops the arm. A driver whose line may be slow talks to it in a thread of
its own and answers from what came last. A call may raise `DeviceError`, or an `OSError` of its
line; the arm is then brought off the surface with what still works.

A new driver is one package under ``elastocal.drivers`` and an entry in the contract tests of
``tests/contracts/``.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
