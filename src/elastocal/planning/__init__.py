"""From a tooling surface to an ordered, checked set of calibration poses (paper 2.2, 3.1)."""
