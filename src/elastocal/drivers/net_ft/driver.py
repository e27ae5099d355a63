"""The line to a Net F/T box, and the driver that cell files name ``net_ft``.

RDT serves one client: whoever asks last has the stream, and nobody is told. So a stream that ends
is followed by a question to the box: where its page answers, somebody else has the stream. It is
not taken back: two programs that take it from one another would both see half of it.
"""

import contextlib
import http.client
import socket
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, TypeVar

from pydantic import Field, FiniteFloat

from elastocal.cell import (
    LOOPBACK,
    Cell,
    Clock,
    DeviceReading,
    DeviceSet,
    DeviceSettings,
    RigContext,
)
from elastocal.drivers.net_ft.protocol import (
    ASK_CALIBRATION,
    MOST_PAGE,
    PAGE,
    BoxConfiguration,
    Command,
    CountScale,
    parse_calibration,
    parse_configuration,
    request,
)
from elastocal.drivers.net_ft.sensor import NetFtSensor
from elastocal.errors import DeviceError, of_kind, present

_SILENCE = 0.25
"""A stream that says nothing for so long, in s of the wall, has ended."""
_PATIENCE = 1.0
"""For page and calibration, in s of the wall."""
_REQUESTS = 4
"""Times that a stream is asked for before the box counts as deaf."""
_CALIBRATION_BYTES = 24
_LOOK_AGAIN = 5.0
"""Between two looks at the calibration of a box that streams, in s of the wall."""
_NO_RECORD = f"no record for {_SILENCE:g} s"
_OFF = ", and its page does not answer: is it off, or the cable unplugged?"
_TAKEN = ", though its page answers: another client has taken the stream"

_Answer = TypeVar("_Answer")
_Port = Annotated[int, Field(ge=1, le=65535)]


class NetFtSettings(DeviceSettings):
    """What stands under a sensor whose driver is ``net_ft``."""

    address: str = LOOPBACK
    """Of the box; ATI ships 192.168.1.1."""
    port: _Port = 49152
    """UDP, RDT."""
    http_port: _Port = 80
    """TCP, configuration page."""
    tcp_port: _Port | None = 49151
    """TCP, calibration: a second source of the counts, looked at while it streams; null: none."""
    rate: Annotated[FiniteFloat, Field(gt=0.0, le=1e5)] | None = None
    """Records a second, for a box whose page does not say."""
    tool_transform: tuple[FiniteFloat, ...] = ()
    """Tool transform of the box, as its page states it; by default there must be none. The cell's
    ``sensor.pose`` then is that of the transformed frame."""
    software_bias: bool = False
    """Whether the box may have a software bias. It hides the tool's weight, and a box that loses
    power forgets it."""


class BoxLine:
    """Sockets and threads to one box; `sensor` is what they feed.

    Parameters
    ----------
    settings : NetFtSettings
        Where the box is.
    clock : Clock
        Of the rig.
    """

    def __init__(self, settings: NetFtSettings, clock: Clock) -> None:
        """Read the configuration and ask for the stream.

        Raises
        ------
        DeviceError
            If the box does not answer, or must not be used as it is set up.
        """
        self._settings = settings
        self.source = f"Net F/T at {settings.address}"
        self.configuration = self._checked(self._named(self._page))
        if settings.tcp_port is not None:
            self._require_same(self._named(self._calibration))
        rate = self.configuration.rate or settings.rate
        if rate is None:
            raise DeviceError(f"{self.source}: its page does not say comrdtrate: give the key rate")
        self.sensor = NetFtSensor(clock, self.configuration.scale, rate, self.source)
        self._closed = threading.Event()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._threads = [
            threading.Thread(target=each, daemon=True) for each in (self._listen, self._watch)
        ]
        try:
            # Connected: datagrams of anybody else never come up.
            self._socket.connect((settings.address, settings.port))
            self._start()
        except (DeviceError, OSError) as error:
            self._socket.close()
            if isinstance(error, DeviceError):
                raise
            raise DeviceError(f"{self.source}: {error.strerror or error}") from error

    def _start(self) -> None:
        """Ask for the stream until it comes, and go on in threads."""
        self._socket.settimeout(_SILENCE)
        for _ in range(_REQUESTS):
            self._socket.send(request(Command.START))
            with contextlib.suppress(TimeoutError):
                self.sensor.received(self._socket.recv(MOST_PAGE))
                break
        else:
            raise DeviceError(
                f"{self.source}: its page answers, but no stream comes from UDP port"
                f" {self._settings.port}: a firewall between, or RDT on another port"
            )
        for thread in self._threads:
            thread.start()

    def reading(self) -> DeviceReading:
        """Return what the box shows.

        A stream that another client has taken is not taken back; it may come again by itself.

        Raises
        ------
        DeviceError
            If the box does not answer, or its counts mean something else.
        """
        shown = self.sensor.reading()
        if shown.state:
            return shown
        if not self._answers():
            raise DeviceError(f"{self.source}: {_NO_RECORD}{_OFF}")
        return replace(shown, problem=shown.problem or f"{_NO_RECORD}{_TAKEN}")

    def close(self) -> None:
        """End stream and threads."""
        self._closed.set()
        with contextlib.suppress(OSError):
            self._socket.send(request(Command.STOP))
        for thread in self._threads:
            thread.join(2.0 * _PATIENCE)
        self._socket.close()

    def _listen(self) -> None:
        while not (self._closed.is_set() or self.sensor.failed):
            try:
                self.sensor.received(self._socket.recv(MOST_PAGE))
            except TimeoutError:
                if not self.sensor.hole:
                    self._end_or_go_on()
            except OSError as error:
                self.sensor.fail(f"{error.strerror or error}")

    def _end_or_go_on(self) -> None:
        """Look why nothing comes; a stream that comes again meanwhile was only held up."""
        why = self._why_silent()
        try:
            self.sensor.received(self._socket.recv(MOST_PAGE))
        except TimeoutError:
            if not self._closed.is_set():
                self.sensor.leave_hole(why)

    def _why_silent(self) -> str:
        return f"{_NO_RECORD}{_TAKEN if self._answers() else _OFF}"

    def _answers(self) -> bool:
        try:
            self._page()
        except (DeviceError, OSError):
            return False
        return True

    def _watch(self) -> None:
        """See that a count goes on to mean the same."""
        look = self._page_scale if self._settings.tcp_port is None else self._calibration
        while not self._closed.wait(_LOOK_AGAIN) and not self.sensor.failed:
            # A box that does not answer, or whose answer is cut off, is known by its stream.
            with contextlib.suppress(OSError, DeviceError):
                scale = look()
                try:
                    self._require_same(scale)
                except DeviceError as error:
                    self.sensor.fail(str(error).removeprefix(f"{self.source}: "))

    def _require_same(self, scale: CountScale) -> None:
        if not scale.same(self.configuration.scale):
            raise DeviceError(
                f"{self.source}: {self.configuration.scale} by its page, {scale} by its calibration"
                " now: it was set to another one, and what its counts mean is not known"
            )

    def _page_scale(self) -> CountScale:
        return self._page().scale

    def _page(self) -> BoxConfiguration:
        settings = self._settings
        line = http.client.HTTPConnection(settings.address, settings.http_port, timeout=_PATIENCE)
        with contextlib.closing(line):
            try:
                line.request("GET", PAGE)
                answer = line.getresponse()
                if answer.status != http.client.OK:
                    raise DeviceError(f"{PAGE} answers {answer.status} {answer.reason}")
                return parse_configuration(answer.read(MOST_PAGE + 1))
            except http.client.HTTPException as error:
                raise DeviceError(f"{PAGE}: no HTTP: {error or type(error).__name__}") from error

    def _calibration(self) -> CountScale:
        settings = self._settings
        port = present(settings.tcp_port, "sensor.tcp_port")
        with socket.create_connection((settings.address, port), _PATIENCE) as line:
            line.sendall(ASK_CALIBRATION)
            reply = b""
            while len(reply) < _CALIBRATION_BYTES and (more := line.recv(_CALIBRATION_BYTES)):
                reply += more
        return parse_calibration(reply)

    def _named(self, ask: Callable[[], _Answer]) -> _Answer:
        """Return an answer; a refusal names the box."""
        try:
            return ask()
        except DeviceError as error:
            raise DeviceError(f"{self.source}: {error}") from error
        except OSError as error:
            raise DeviceError(
                f"{self.source} does not answer: {error.strerror or error}"
            ) from error

    def _checked(self, found: BoxConfiguration) -> BoxConfiguration:
        """Refuse a box that is not set up for raw forces in its own frame."""
        if not found.rdt:
            raise DeviceError(f"{self.source}: RDT is switched off (page Communications)")
        wanted = self._settings.tool_transform or (0.0,) * len(found.transform)
        if found.transform != wanted:
            stated = ", ".join(f"{value:g}" for value in found.transform)
            raise DeviceError(
                f"{self.source} has the tool transform {stated}: set it to 0, or state it"
                " (key tool_transform) and give sensor.pose of the transformed frame"
            )
        if any(found.bias) and not self._settings.software_bias:
            raise DeviceError(
                f"{self.source} has a software bias, which hides the tool's weight: clear it, or"
                " allow it (software_bias: true)"
            )
        return found


@dataclass(frozen=True)
class NetFtDriver:
    """Makes sensors of ATI Net F/T boxes; see `elastocal.cell.Driver`."""

    kinds = frozenset({"sensor"})
    real = False

    def settings(self, kind: str) -> type[DeviceSettings]:  # noqa: ARG002 - the protocol's form
        """Return the settings of the sensor."""
        return NetFtSettings

    def connect(
        self,
        cell: Cell,  # noqa: ARG002 - the protocol's form
        wanted: Mapping[str, DeviceSettings],
        context: RigContext,
    ) -> DeviceSet:
        """Connect to the box; its stream begins.

        Raises
        ------
        DeviceError
            If the box does not answer, or must not be used as it is set up.
        """
        settings = of_kind(wanted["sensor"], NetFtSettings, "settings")
        line = BoxLine(settings, context.clock)
        sensor = line.sensor
        readings = (lambda: (line.reading(),)) if context.watches else None
        return DeviceSet(
            sensor=sensor, feed=sensor, close=line.close, lines=sensor.lines, readings=readings
        )


DRIVER = NetFtDriver()
