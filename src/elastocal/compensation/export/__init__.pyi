from .writer import c_files as c_files, write_c as write_c
