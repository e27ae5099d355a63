"""elastocal: in-situ elastic calibration of industrial robots.

The method is that of Monsarrat et al., "In-situ elastic calibration of robots", Robotics and
Computer-Integrated Manufacturing (2024), doi:10.1016/j.rcim.2024.102743, called *the paper*
throughout. Import from the subpackages: `elastocal.robot`, `elastocal.elastic`,
`elastocal.dataset`, `elastocal.identification`.
"""

from importlib.metadata import version

__version__ = version("elastocal")
