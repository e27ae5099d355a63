from .krl import check_name as check_name, takes_krl as takes_krl, write_krl as write_krl
from .table import write_table as write_table
