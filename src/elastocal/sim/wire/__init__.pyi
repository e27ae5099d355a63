from .emscon import (
    EmsconServer as EmsconServer,
    restart as restart,
    say_change as say_change,
    say_error as say_error,
)
from .line_stream import LineStreamServer as LineStreamServer
from .live_cell import LiveCell as LiveCell
from .servers import (
    SERVERS as SERVERS,
    MakeServer as MakeServer,
    Told as Told,
    WireServer as WireServer,
    serves as serves,
    wire_servers as wire_servers,
)
