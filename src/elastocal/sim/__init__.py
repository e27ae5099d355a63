"""Simulated truth. Only the composition roots and the tests may import it.

It is made by other equations than the estimator's: no Pinocchio, no `elastocal.elastic`.

==================  ===========================================================================
`linkage`           the rigid arm, read from a URDF with `xml.etree`
`screws`            its kinematics, by products of exponentials
`torque_laws`       linear springs and gears that stiffen
`skeleton`          where the springs sit
`statics`           potential energy under dead loads, with exact derivatives
`newton`            its minimum
`truth`             `ElasticArm`: deflection of the true arm
`layouts`           ready-made arms
`reach`, `scene`    calibration poses and load cases without a planner
`measurement`       what Procedure 1 of the paper records on the true arm
`workcell`          a whole cell in time: arm, force sensor, tracker, clock, faults
==================  ===========================================================================
"""
