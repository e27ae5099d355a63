"""Figures of the documentation, made by its build; see ``docs/hooks/figures.py``.

===========  ====================================================================
`campaign`   a cell that is planned, measured in simulation, and calibrated
`placement`  figures of the fibre placement example
`machining`  figures of the machining example
`small`      the k-centre problem, and the streams of one pose
`budget`     what the error of a calibration is made of
`studio`     the page that shows a cell
`demos`      every example cell on every truth
`instruments`  a process after corrections by a tracker, without one, and with encoders
`faults`     what every fault does in every phase of a press, from data that is kept
`stopping`   campaigns that stop by themselves, from data that is kept
`notebooks`  the notebooks of the site, run
`kept`       how figures that take long to measure are kept
`process_figures`  Table 1 over truths and seeds, measured by one command and quoted
===========  ====================================================================
"""
