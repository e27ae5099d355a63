from .live_cell import LiveCell as LiveCell
from .servers import (
    SERVERS as SERVERS,
    MakeServer as MakeServer,
    Told as Told,
    WireServer as WireServer,
    serves as serves,
    wire_servers as wire_servers,
)
