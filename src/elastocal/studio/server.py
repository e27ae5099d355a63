"""The server of the studio: one page, one token, one origin; every message is bounded.

The address gives access to everything that the page can do, so it contains a token that is drawn at
each start, and no request is answered without it. Foreign pages in the same browser are excluded by
three means: by the token, which they do not know; by ``Host``, against DNS rebinding; and by
``Origin`` and ``Sec-Fetch-Site``, which browsers set correctly. The page itself may load only its
own files and run no other script.
"""

import contextlib
import hmac
import ipaddress
import json
import secrets
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import resources
from socket import SHUT_RDWR, socket
from typing import Any
from urllib.parse import urlsplit

from elastocal.cell import LOOPBACK
from elastocal.errors import DeviceError, ElastocalError, SchemaError
from elastocal.records import parse_json

MOST_BYTES = 1_000_000
"""Largest size of a message to the server."""
_CONNECTIONS = 32
"""Answered at a time; for more, those that have not shown the token yet are hung up."""
_HANGING_UP = 1.0
"""Longest time that it takes until one is gone, in s."""
_PATIENCE = 30.0
"""Longest silence of a browser within a message, in s."""
_HEARTBEAT = 10.0
"""Longest silence of the server towards a page that listens, in s."""
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self'"
    " data:; form-action 'none'; base-uri 'none'; frame-ancestors 'none'"
)
_HEADERS = {
    "Content-Security-Policy": _POLICY,
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
}
_KINDS = {"html": "text/html", "css": "text/css", "js": "text/javascript"}
_FILES = {
    "": ("elastocal.studio", "page/studio.html"),
    **{
        name: ("elastocal.studio", f"page/{name}")
        for name in ("studio.css", "studio.js", "forms.js", "runs.js")
    },
    **{name: ("elastocal.viewer", name) for name in ("viewer.css", "viewer.js")},
}
"""Package and file behind each name."""
_JSON = "application/json"

Action = Callable[[Any], Mapping[str, object]]
"""Takes the message of a page, returns the answer to it; refuses with an `ElastocalError`."""
News = Callable[[int, float], tuple[int, Mapping[str, object]]]
"""Takes the number of the last news and how long to wait, in s; returns the newest, numbered."""


class _RefusedError(Exception):
    """A request that is answered with a status and a line, and nothing else."""

    def __init__(self, status: HTTPStatus, reason: str) -> None:
        super().__init__(reason)
        self.status = status


@dataclass(frozen=True)
class _Door:
    """Access control."""

    token: str
    host: str
    """Address that the server is bound to."""
    port: int

    def require(self, headers: Any, path: str) -> str:
        """Return the answer to a request behind the token.

        Raises
        ------
        _RefusedError
            If a header or the token is not ours.
        """
        if not self._is_own_host(headers.get_all("Host") or []):
            raise _RefusedError(HTTPStatus.MISDIRECTED_REQUEST, "not a name of this server")
        origins = headers.get_all("Origin") or []
        if any(origin != f"http://{headers['Host']}" for origin in origins):
            raise _RefusedError(HTTPStatus.FORBIDDEN, "a page of another origin")
        # A file, or a link, may lead to the page; it reads nothing of it.
        kinds = headers.get("Sec-Fetch-Mode"), headers.get("Sec-Fetch-Dest")
        own = headers.get("Sec-Fetch-Site", "none") in ("same-origin", "none")
        if not own and kinds != ("navigate", "document"):
            raise _RefusedError(HTTPStatus.FORBIDDEN, "a page of another site")
        try:
            _, token, name = [*urlsplit(path).path.split("/", 2), "", "?"][:3]
        except ValueError as error:
            raise _RefusedError(HTTPStatus.BAD_REQUEST, "not an address") from error
        if not hmac.compare_digest(token.encode(), self.token.encode()):
            raise _RefusedError(HTTPStatus.FORBIDDEN, "the address needs its token")
        return name

    def _is_own_host(self, stated: list[str]) -> bool:
        """Return whether a request names this server by a number, or as localhost.

        A number cannot be made to lead elsewhere; a name can.
        """
        bound = ipaddress.ip_address(self.host)
        try:
            (host,) = stated
            asked = urlsplit(f"//{host}")
            if host == f"localhost:{self.port}":
                return bound.is_loopback
            address, port = ipaddress.ip_address(asked.hostname or ""), asked.port or 80
        except ValueError:  # several hosts, or none; a name
            return False
        return port == self.port and (bound.is_unspecified or address == bound)


class StudioServer:
    """Answers a page until it is closed.

    Parameters
    ----------
    actions : mapping
        What a page may ask for, by name.
    news : callable
        Source of the news for a listening page.
    host : str
        Address to bind to.
    port : int
        0: the system chooses.

    Raises
    ------
    DeviceError
        If the port is taken, or the host none of this machine's addresses.
    """

    def __init__(
        self, actions: Mapping[str, Action], news: News, host: str = LOOPBACK, port: int = 0
    ) -> None:
        try:
            ipaddress.ip_address(host)
        except ValueError as error:
            raise DeviceError(f"--host {host!r}: must be an address in numbers") from error
        self.token = secrets.token_urlsafe(24)
        self._closing = threading.Event()
        try:
            self._server = _Listener((host, port), _Request)
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or error
            raise DeviceError(f"cannot listen on {host}:{port}: {reason}") from error
        self.port = int(self._server.server_address[1])
        self._server.door = _Door(self.token, host, self.port)
        self._server.actions, self._server.news = actions, news
        self._server.closing = self._closing
        shown = LOOPBACK if ipaddress.ip_address(host).is_unspecified else host
        shown = f"[{shown}]" if ":" in shown else shown
        self.address = f"http://{shown}:{self.port}/{self.token}/"
        self._thread = threading.Thread(
            target=self._server.serve_forever, name="studio", daemon=True
        )

    def start(self) -> None:
        """Begin to answer."""
        self._thread.start()

    def close(self) -> None:
        """Stop answering, and give the port back."""
        self._closing.set()
        if self._thread.is_alive():
            self._server.shutdown()
        self._server.server_close()


class _Listener(ThreadingHTTPServer):
    """Takes connections, no more at a time than it can answer."""

    daemon_threads = True
    block_on_close = False
    allow_reuse_address = False
    request_queue_size = _CONNECTIONS
    door: _Door
    actions: Mapping[str, Action]
    news: News
    closing: threading.Event

    def __init__(self, *arguments: Any) -> None:
        self._free = threading.BoundedSemaphore(_CONNECTIONS)
        self._strangers: dict[socket, None] = {}
        """Connections on which no token has come yet, the oldest first."""
        super().__init__(*arguments)

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer in a thread; where all are busy, instead of the oldest that says nothing."""
        if not self._free.acquire(blocking=False):
            oldest = next(iter([*self._strangers]), None)
            if oldest is not None:
                self.let_in(oldest)
                with contextlib.suppress(OSError):
                    oldest.shutdown(SHUT_RDWR)
            if oldest is None or not self._free.acquire(timeout=_HANGING_UP):
                self.shutdown_request(request)
                return
        self._strangers[request] = None
        super().process_request(request, client_address)

    def let_in(self, request: socket) -> None:
        """Keep a connection that has shown the token."""
        self._strangers.pop(request, None)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Answer, and let the next one in."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self.let_in(request)
            self._free.release()

    def handle_error(self, request: socket | tuple[bytes, socket], client_address: Any) -> None:
        """Ignore browsers that disconnect."""


class _Request(BaseHTTPRequestHandler):
    """One connection of a browser."""

    server: _Listener
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "elastocal", ""
    timeout = _PATIENCE

    def do_GET(self) -> None:
        """Hand out the page, its files, or the news."""
        self._answer(self._get)

    def do_POST(self) -> None:
        """Carry out an action."""
        self._answer(self._post)

    def log_message(self, *_: Any) -> None:
        """Keep the terminal free: its first line is the address."""

    def _answer(self, work: Callable[[str], None]) -> None:
        try:
            name = self.server.door.require(self.headers, self.path)
            self.server.let_in(self.connection)
            work(name)
        except _RefusedError as error:
            self.close_connection = True
            self._send(error.status, f"{error}\n".encode(), "text/plain; charset=utf-8")
        except (ConnectionError, TimeoutError):
            self.close_connection = True

    def _get(self, name: str) -> None:
        if name == "news":
            self._tell_news()
            return
        if name not in _FILES:
            raise _RefusedError(HTTPStatus.NOT_FOUND, "no such page")
        package, file = _FILES[name]
        kind = _KINDS[file.rpartition(".")[2]]
        text = resources.files(package).joinpath(file).read_bytes()
        self._send(HTTPStatus.OK, text, f"{kind}; charset=utf-8")

    def _post(self, name: str) -> None:
        message = self._message()
        action = self.server.actions.get(name)
        if action is None:
            raise _RefusedError(HTTPStatus.NOT_FOUND, "no such action")
        try:
            status, answer = HTTPStatus.OK, action(message)
        except ElastocalError as error:
            status, answer = HTTPStatus.UNPROCESSABLE_ENTITY, {"refusal": str(error)}
        self._send(status, json.dumps(answer, allow_nan=False).encode(), _JSON)

    def _message(self) -> Any:
        """Return the JSON that a page has sent."""
        if self.headers.get("Content-Type", "").partition(";")[0].strip() != _JSON:
            # Forms of other pages can send no JSON without asking first, which is not answered.
            raise _RefusedError(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "messages are JSON")
        length, *others = self.headers.get_all("Content-Length") or [""]
        known = length.isascii() and length.isdigit() and not others
        if "Transfer-Encoding" in self.headers or not known:
            raise _RefusedError(HTTPStatus.LENGTH_REQUIRED, "messages state their length")
        if len(length) > 12 or int(length) > MOST_BYTES:
            raise _RefusedError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, "the message is too long")
        text = self.rfile.read(int(length))
        if len(text) < int(length):
            raise _RefusedError(HTTPStatus.BAD_REQUEST, "the message is cut off")
        try:
            return parse_json(text, "the message", finite=True)
        except SchemaError as error:
            raise _RefusedError(HTTPStatus.BAD_REQUEST, "the message is no JSON") from error

    def _tell_news(self) -> None:
        """Send news for as long as the page listens (server-sent events)."""
        self.close_connection = True
        self._head(HTTPStatus.OK, {"Content-Type": "text/event-stream; charset=utf-8"})
        number = -1
        while not self.server.closing.is_set():
            newest, told = self.server.news(number, _HEARTBEAT)
            text = ":\n\n" if newest == number else f"data: {json.dumps(told, allow_nan=False)}\n\n"
            number = newest
            self.wfile.write(text.encode())
            self.wfile.flush()

    def _send(self, status: HTTPStatus, body: bytes, kind: str) -> None:
        self._head(status, {"Content-Type": kind, "Content-Length": str(len(body))})
        self.wfile.write(body)

    def _head(self, status: HTTPStatus, more: Mapping[str, str]) -> None:
        self.send_response(status)
        for name, value in (*_HEADERS.items(), *more.items()):
            self.send_header(name, value)
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
