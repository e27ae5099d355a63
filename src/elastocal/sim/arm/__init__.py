"""Elastic arms that share no equation with the estimator.

===============  ==============================================================================
`linkage`        the rigid arm, read from a URDF with `xml.etree`; products of exponentials, inverse
`springs`        torque laws of single springs, and where the springs sit
`gears`          a bank of springs whose gears stiffen, lose way and remember; a balancer
`statics`        potential energy under dead loads, with exact derivatives, and its minimum
`elastic_arm`    `ElasticArm`: deflection of the true arm; ready-made arms
`measurement`    calibration poses, load cases, and what Procedure 1 records
===============  ==============================================================================
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
