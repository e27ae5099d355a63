"""Figures: matplotlib for paper, Plotly for the screen.

========================  ====================================================================
`style`                   palette, styles of variants, pages in inches, files of figures
`codec_chart`             errors on paper: of a codec, of a study
`analysis_charts`         compliances and indices of a codec on paper
`interactive_codec`       errors and compliances of a codec on the screen
`plan_figure`             a plan on paper: the surface laid flat, poses of two techniques
`plan_scene`              a plan in three dimensions: robot, tooling, stations, postures
`calibration_figures`     readings, residuals, registration and springs of a calibration
`process_figures`         deviation along a process path before and after correction
`stiffness_figure`        stiffness over spin and rail along a path
`recertification_figure`  two calibrations compared
`results`                 what `plot` of a workflow's result shows
========================  ====================================================================
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
