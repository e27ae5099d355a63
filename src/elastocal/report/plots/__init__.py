"""Figures: matplotlib for paper, Plotly for the screen.

========================  ====================================================================
`style`                   palette, styles of variants, pages in inches, files of figures
`codec_chart`             errors on paper: of a codec, of a study
`analysis_charts`         compliances and indices of a codec on paper
`interactive_codec`       errors and compliances of a codec on the screen
`plan_figure`             a plan on paper: the surface laid flat, poses of two techniques
`plan_scene`              a plan in three dimensions: robot, tooling, stations, postures
`spring_figures`          springs of one calibration, and two calibrations compared
`path_figures`            stiffness along a process path, deviation before and after correction
`results`                 readings and registration; what `plot` of a workflow's result shows
========================  ====================================================================
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
