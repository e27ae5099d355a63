"""Study: Monte-Carlo over simulated cells, before anybody travels.

Pure: what is simulated comes in as a function of the sample, where it is done as a function that
spreads batches. `elastocal.workflows.study` brings the simulation.

============  ===================================================================================
`conditions`  what may be varied; conditions
`poses`       one pool of valid poses: verification poses set aside, the choice of each condition
`samples`     sample, its generators, its fit, accuracy at unseen poses; the folder with design
              and finished samples, from which a killed study goes on
`sampling`    batches, on processes or a Dask cluster
`summary`     medians, quantiles, shares with intervals; tidy tables and ``study.json``
============  ===================================================================================
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
