from .dialogue import (
    Dialogue as Dialogue,
    EmsconSettings as EmsconSettings,
    EmsconStation as EmsconStation,
)
from .driver import DRIVER as DRIVER, EmsconDriver as EmsconDriver
from .packets import (
    LARGEST_PACKET as LARGEST_PACKET,
    STATUS_TEXTS as STATUS_TEXTS,
    Answer as Answer,
    Code as Code,
    Complaint as Complaint,
    MeasuredPoints as MeasuredPoints,
    Mode as Mode,
    Packet as Packet,
    PacketReader as PacketReader,
    Reflector as Reflector,
    StatusChange as StatusChange,
    command as command,
    status_text as status_text,
)
