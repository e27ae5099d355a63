from ._pos_corr import PosCorrLimits as PosCorrLimits
from ._rsi_robot import RsiContext as RsiContext
from .emscon import EmsconServer as EmsconServer
from .line_stream import LineStreamServer as LineStreamServer
from .live_cell import (
    LiveCell as LiveCell,
    TruePress as TruePress,
)
from .net_ft import (
    NetFtBox as NetFtBox,
    NetFtServer as NetFtServer,
    net_ft_server as net_ft_server,
)
from .rsi import (
    IPOC_START as IPOC_START,
    SENTYPE as SENTYPE,
    RsiFault as RsiFault,
    RsiServer as RsiServer,
    RsiStatistics as RsiStatistics,
    TakenAnswer as TakenAnswer,
    ethernet_config as ethernet_config,
    rsi_server as rsi_server,
)
from .rtde import PORTS as PORTS, RtdeServer as RtdeServer, rtde_server as rtde_server
from .servers import (
    SERVERS as SERVERS,
    MakeServer as MakeServer,
    Told as Told,
    WireServer as WireServer,
    bound as bound,
    serves as serves,
    suited_servers as suited_servers,
    wire_servers as wire_servers,
)
