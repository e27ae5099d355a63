from .live_cell import (
    LiveCell as LiveCell,
)
from .servers import (
    Told as Told,
    WireServer as WireServer,
    suited_servers as suited_servers,
    wire_servers as wire_servers,
)
