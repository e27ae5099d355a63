from .actuated import actuated as actuated
from .bearing import bearing as bearing
from .custom import custom as custom, read_springs as read_springs
from .named import LAYOUTS as LAYOUTS, layout as layout
