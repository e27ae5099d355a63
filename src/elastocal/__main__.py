"""``python -m elastocal``: the program where its folder is not on the path."""

from _elastocal_program import run

run()
