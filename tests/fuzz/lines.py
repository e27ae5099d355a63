"""The parsers of everything that devices send, under Atheris: coverage chooses the next damage.

``make fuzz-lines`` runs it for 10 s, or as `UNTIL` says; it ends with what fell, or with the number
of inputs. Whatever comes is read, or refused by an error of ours in one line. The Hypothesis and
the random versions are in ``tests/drivers``.
"""

import struct
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

try:
    import atheris
except ImportError:
    print("atheris is not installed here: nothing was fuzzed", file=sys.stderr)
    sys.exit(0)

with atheris.instrument_imports(include=["elastocal.drivers"]):
    from elastocal.drivers.emscon.packets import Code, PacketReader, command
    from elastocal.drivers.kuka_rsi.context import read_context
    from elastocal.drivers.kuka_rsi.ethernet_file import check_ethernet_file
    from elastocal.drivers.kuka_rsi.messages import read_rob
    from elastocal.drivers.line_stream.driver import LineReader
    from elastocal.drivers.net_ft.protocol import (
        parse_calibration,
        parse_configuration,
        parse_records,
    )
from elastocal.errors import ElastocalError

ROB = (
    b'<Rob Type="KUKA"><RIst X="1620.9" Y="0.0" Z="1909.9" A="0.0" B="90.0" C="0.0"/><AIPos'
    b' A1="0.0" A2="-90.0" A3="90.0" A4="0.0" A5="90.0" A6="0.0"/><Delay D="0"/><DiL>0</DiL>'
    b"<IPOC>4208163634</IPOC></Rob>"
)
ETHERNET = (
    b"<ROOT><CONFIG><PORT>59152</PORT><ONLYSEND>FALSE</ONLYSEND></CONFIG><RECEIVE><ELEMENTS>"
    b'<ELEMENT TAG="RKorr.X" TYPE="DOUBLE" INDX="2" HOLDON="1"/></ELEMENTS></RECEIVE></ROOT>'
)
CONTEXT = (
    b'<RSIObjects><RSIObject ObjType="STOP" ObjTypeID="18" ObjID="STOP1"><Inputs><Input InIdx="1"'
    b' OutObjID="STOP1" OutIdx="1"/></Inputs><Parameters><Parameter Name="Mode" ParamID="1"'
    b' ParamValue="4"/></Parameters></RSIObject></RSIObjects>'
)
PAGE = b"<netft><cfgcpf>1000000</cfgcpf><scfgfu>N</scfgfu><comrdte>Enabled</comrdte></netft>"
LINES = b"t[s],x[mm],y[mm],z[mm]\n1.5,2412.07,-310.4,1203.1\nframe setup 3\nbeam broken\n"
PARSERS: tuple[tuple[Callable[[bytes], object], bytes], ...] = (
    (read_rob, ROB),
    (parse_records, struct.pack(">III6i", 1, 7, 0, *range(6))),
    (parse_calibration, struct.pack(">HBBII6H", 0x1234, 2, 3, 10**6, 1000, *(1,) * 6)),
    (parse_configuration, PAGE),
    (lambda data: list(LineReader().feed(data)), LINES),
    (lambda data: list(PacketReader().feed(data)), command(Code.SET_UNITS, 0, 0, form="2i")),
    (
        lambda data: check_ethernet_file(data.decode("latin-1"), "contact"),
        ETHERNET,
    ),
    (lambda data: read_context(data.decode("latin-1")), CONTEXT),
)
"""Each parser with a message that it reads; the first byte of an input chooses one."""


def one_input(data: bytes) -> None:
    """Let a parser read the input; anything but an error of ours in one line escapes."""
    if not data:
        return
    parse, _ = PARSERS[data[0] % len(PARSERS)]
    try:
        parse(data[1:])
    except ElastocalError as error:
        if "\n" in str(error):
            raise


def main(arguments: list[str]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        for number, (_, seed) in enumerate(PARSERS):
            (Path(folder) / str(number)).write_bytes(bytes([number]) + seed)
        atheris.Setup([*arguments, folder], one_input)
        atheris.Fuzz()


if __name__ == "__main__":
    main(sys.argv)
