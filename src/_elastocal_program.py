"""The program `elastocal`, as people start it: Ctrl-C ends it quietly while it is being imported.

It stands beside the package, whose first import takes longer than all else here: what came in
between would end in a traceback. `elastocal.cli._signals` goes on from there.
"""

import signal

if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)

from elastocal.cli import run as run
