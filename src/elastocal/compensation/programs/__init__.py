"""Programs of robot controllers: written by brand, and corrected offline.

`writer` is a program in no language and what a language makes of it; `krl_writer`, `rapid_writer`,
`fanuc_writer`, `urscript_writer` and `as_writer` are the languages, `languages` chooses one,
`plan_program` is what a plan says in any of them, `path_program` what a corrected path does.
`program` is the protocol of a program that is read, `correct` corrects any of them, `krl` reads
those of KUKA.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
