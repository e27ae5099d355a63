from .linux import (
    LINUX_FILES as LINUX_FILES,
    LinuxTarget as LinuxTarget,
    linux_files as linux_files,
)
from .writer import c_files as c_files, write_c as write_c
