"""Figures: matplotlib for paper, Plotly for the screen.

========================  ====================================================================
`style`, `printing`       palette, styles of variants, files of figures
`codec_chart` ...         codecs on paper: errors, compliances, indices; `study_figure`
`interactive_codec`       the same on the screen
`plan_figure`             a plan on paper: the surface laid flat, poses of two techniques
`plan_scene`              a plan in three dimensions: robot, tooling, stations, postures
`calibration_figures`     readings, residuals, registration and springs of a calibration
`process_figures`         deviation along a process path before and after correction
`stiffness_figure`        stiffness over spin and rail along a path
`recertification_figure`  two calibrations compared
========================  ====================================================================
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
