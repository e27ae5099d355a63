from .program import KrlProgram as KrlProgram, read_krl as read_krl
