from .names import check_name as check_name
from .program import write_krl as write_krl
from .targets import takes_krl as takes_krl
