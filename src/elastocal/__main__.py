"""``python -m elastocal``: the program where no script of it is on the path."""

from _elastocal_program import run

if __name__ == "__main__":
    run()
