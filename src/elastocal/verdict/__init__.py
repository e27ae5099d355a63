"""The verdict on a calibration: evidence is gathered, compared and judged; nothing is rendered.

=============  ==================================================================
`gather`       from the files of a run to its evidence, with what is missing
`evidence`     the parts, and whether they belong together
`findings`     what a reader has to know, part by part
`judgement`    light, sentence, reasons, advice
=============  ==================================================================
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
