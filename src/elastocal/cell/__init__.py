"""The cell: the file that describes it, and the devices that carry out a procedure in it.

============  =================================================================================
`cell`        the whole file, and `Cell`: robot made, files found; its fingerprint
`hardware`    robot, tool, sensor, marker, trackers; tooling surface and other solids
`procedure`   load cases, limits, search for poses, Procedure 1, what its result is held against
`motion`      HOME, axis speeds, positions of the external axes
`devices`     protocols of arm, force sensor, tracker and clock
`reading`     what one device shows to a person who only looks
`rig`         which driver makes each device, and what a driver has to do
`examples`    the cells that ``elastocal init`` writes
============  =================================================================================
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
