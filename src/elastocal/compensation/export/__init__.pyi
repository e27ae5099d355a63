from .linux import (
    LinuxTarget as LinuxTarget,
    linux_files as linux_files,
)
from .writer import (
    write_c as write_c,
)
