"""KUKA arms over the Robot Sensor Interface (RSI): link, arm, commissioning, controller files.

===============  ==============================================================================
`messages`       ``<Rob>`` and ``<Sen>``, their reader and writer
`link`           thread that answers each datagram; counts what is late, lost, out of order
`settings`       section of the cell file, and the bounds that follow from it
`posture`        joints and tool frame in SI, from and to the pendant's numbers
`motions`        free moves, guarded moves, force control, cycle by cycle
`force_control`  the admittance law and its margins
`corrections`    final limits on each correction; corrections of a programmed path
`arm`            the arm as `elastocal run` uses it
`commissioning`  the delay from command to motion, measured and kept
===============  ==============================================================================

Verified against simulators and public layouts, not on hardware.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
