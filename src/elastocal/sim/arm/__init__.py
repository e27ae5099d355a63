"""Elastic arms that share no equation with the estimator.

===============  ==============================================================================
`linkage`        the rigid arm, read from a URDF with `xml.etree`; products of exponentials
`inverse`        its inverse kinematics
`springs`        torque laws of springs and gears, and where the springs sit
`statics`        potential energy under dead loads, with exact derivatives, and its minimum
`elastic_arm`    `ElasticArm`: deflection of the true arm; ready-made arms
`measurement`    calibration poses, load cases, and what Procedure 1 records
===============  ==============================================================================
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
