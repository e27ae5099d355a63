"""HTML pages that hold all they need and ask the network for nothing: a plan, a codec.

Templates are Jinja2, in the folder ``templates``; `templating` is the only place that renders.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
