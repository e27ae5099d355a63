"""Study: Monte-Carlo over simulated cells, before anybody travels.

Pure: what is simulated comes in as a function of the sample, where it is done as a function that
spreads batches. `elastocal.cli.study_simulation` and `elastocal.cli.study_spread` bring both.

==============  =================================================================================
`factors`       what may be varied; conditions
`samples`       sample, its generators, its result
`calibrating`   fit, and accuracy at unseen poses
`settings`      what a study is a study of
`store`         folder with finished samples; a killed study goes on
`running`       batches
`summary`       medians, quantiles, shares with intervals
`files`         tidy tables and ``study.json``
==============  =================================================================================
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
