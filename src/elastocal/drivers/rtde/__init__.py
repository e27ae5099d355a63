"""Universal Robots over RTDE, by the package ``ur-rtde`` (extra ``elastocal[ur]``).

The controller does the force control: its force mode makes contact and holds the load cases. Its
own sensor may be the force sensor of the rig. Verified against simulator and public layout, not
hardware.

==========  =====================================================================================
`line`      what is used of ``ur-rtde``, and the newest sample of the controller
`arm`       the arm: steps of the procedure as commands of the controller, in a thread
`driver`    settings, and the driver that cell files name ``rtde``
==========  =====================================================================================
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
