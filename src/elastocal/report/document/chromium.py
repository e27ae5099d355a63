"""Drive a headless Chromium through a pipe.

The page itself reports when it is ready, so no waiting time is guessed. The browser's DevTools
protocol goes over two pipes (file descriptors 3 and 4 of the child): no port is opened, and the
network is not used.
"""

import base64
import json
import os
import select
import shutil
import subprocess
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from elastocal.errors import FileAccessError
from elastocal.files import replacing
from elastocal.records import parse_json

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome", "msedge")
"""Names that are looked for on the search path, in order."""
_APPLICATIONS = (
    "Google Chrome.app/Contents/MacOS/Google Chrome",
    "Chromium.app/Contents/MacOS/Chromium",
    "Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
)
"""Folders of applications on macOS, which no search path contains."""
_APPLICATION_FOLDERS = (Path("/Applications"), Path.home() / "Applications")
_SECONDS = 180.0
"""Longest wait for an answer: a software renderer on a busy machine is slow."""
_GRACE = 5.0
"""Longest wait for a browser to end by itself."""
_FLAGS = (
    "--headless", "--remote-debugging-pipe", "--use-gl=angle",
    "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-sandbox",
    "--disable-background-networking", "--disable-component-update", "--disable-extensions",
    "--disable-sync", "--no-first-run", "--no-default-browser-check", "--hide-scrollbars",
)  # fmt: skip
_NO_SANDBOX = "--no-sandbox"
_READY = """new Promise((done) => {
  const ready = () => document.documentElement?.dataset.ready === "yes";
  const look = () => ready() ? done(true) : setTimeout(look, 20);
  look();
})"""
_UNFOLD = "document.querySelectorAll('details.section').forEach((each) => { each.open = true; })"
"""Before a whole document is printed: what is folded is not."""

Message = Mapping[str, Any]
"""A JSON object of the DevTools protocol."""


def find_browser() -> str:
    """Return the path of a Chromium.

    Raises
    ------
    FileAccessError
        If there is none.
    """
    if os.name != "posix":
        raise FileAccessError(
            "--pdf needs Linux or macOS: open the report in a browser and print it, it is made for"
            " paper"
        )
    for name in BROWSERS:
        found = shutil.which(name)
        if found is not None:
            return found
    for place in (folder / name for folder in _APPLICATION_FOLDERS for name in _APPLICATIONS):
        if place.is_file():
            return str(place)
    raise FileAccessError(f"--pdf needs a Chromium: none of {', '.join(BROWSERS)} is on the path")


def write_pdf(page: Path, path: Path, browser: str) -> Path:
    """Print a page to a PDF file, atomically, with all of its appendix; return its path.

    Parameters
    ----------
    page : Path
        HTML file that sets ``data-ready`` of its root to ``yes`` when it is drawn.
    path : Path
        PDF file.
    browser : str
        From `find_browser`.

    Raises
    ------
    FileAccessError
        If the browser fails or the file cannot be written.
    """
    with replacing(path) as temporary, open_tab(browser) as tab:
        tab.open(page)
        tab.evaluate(_UNFOLD)
        printed = tab.call("Page.printToPDF", preferCSSPageSize=True, printBackground=True)
        temporary.write_bytes(base64.b64decode(printed["data"]))
    return path


class Tab:
    """One page in a browser that was started by `open_tab`."""

    def __init__(self, browser: str, read: int, write: int) -> None:
        self._browser, self._read, self._write = browser, read, write
        self._buffer, self._count, self._session = b"", 0, ""
        self.events: list[Message] = []
        """Messages that the page and the browser sent by themselves."""
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        attached = self.call("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        self.call("Page.enable")

    def call(self, method: str, **parameters: Any) -> Message:
        """Return the answer to a command of the DevTools protocol.

        Raises
        ------
        FileAccessError
            If the browser refuses, ends, or does not answer.
        """
        self._count += 1
        session = {"sessionId": self._session} if self._session else {}
        message = {"id": self._count, "method": method, "params": parameters, **session}
        self._send(json.dumps(message).encode() + b"\0")
        deadline = time.monotonic() + _SECONDS
        while True:
            answer = self._next(deadline)
            if answer.get("id") != self._count:
                self.events.append(answer)
            elif "error" in answer:
                raise self._failed(answer["error"].get("message", "no reason"))
            else:
                return dict(answer["result"])

    def open(self, page: Path) -> None:
        """Show a page and wait until it says that it is ready."""
        self.call("Page.navigate", url=page.resolve().as_uri())
        self.evaluate(_READY)

    def evaluate(self, expression: str) -> Any:
        """Return the value of an expression in the page; a promise is waited for."""
        answer = self.call(
            "Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True
        )
        if "exceptionDetails" in answer:
            raise self._failed(answer["exceptionDetails"].get("text", "no reason"))
        return answer["result"].get("value")

    def _send(self, data: bytes) -> None:
        try:
            while data:
                data = data[os.write(self._write, data) :]
        except OSError as error:
            raise self._failed("it ended") from error

    def _next(self, deadline: float) -> Message:
        while b"\0" not in self._buffer:
            left = deadline - time.monotonic()
            if left <= 0.0 or not select.select([self._read], [], [], left)[0]:
                raise self._failed(f"no answer within {_SECONDS:.0f} s")
            more = os.read(self._read, 1 << 20)
            if not more:
                raise self._failed("it ended")
            self._buffer += more
        text, _, self._buffer = self._buffer.partition(b"\0")
        return dict(parse_json(text, "what the browser says"))

    def _failed(self, reason: str) -> FileAccessError:
        return FileAccessError(f"{self._browser} did not show the page: {reason}")


@contextmanager
def open_tab(browser: str) -> Iterator[Tab]:
    """Start a browser with a profile of its own and yield a tab; end it with the block.

    It runs in its sandbox where that is possible: it refuses one for root, and the kernel of many
    containers allows none.

    Parameters
    ----------
    browser : str
        From `find_browser`.

    Raises
    ------
    FileAccessError
        If it cannot be started.
    """
    with ExitStack() as started:
        tab = None
        if os.geteuid() != 0:
            with suppress(FileAccessError):
                tab = started.enter_context(_tab(browser, *_FLAGS))
        yield tab or started.enter_context(_tab(browser, *_FLAGS, _NO_SANDBOX))


@contextmanager
def _tab(browser: str, *flags: str) -> Iterator[Tab]:
    with TemporaryDirectory(prefix="elastocal-", ignore_cleanup_errors=True) as profile:
        ends = [_high(end) for end in (*os.pipe(), *os.pipe())]
        to_child, write, read, from_child = ends
        process = None
        try:
            process = _start([browser, *flags, f"--user-data-dir={profile}"], to_child, from_child)
            for end in (to_child, from_child):
                os.close(end)
                ends.remove(end)
            yield Tab(browser, read, write)
        finally:
            for end in ends:
                os.close(end)
            if process is not None:
                _end(process)


def _high(end: int) -> int:
    """Return a copy of a descriptor that does not collide with those of the child."""
    import fcntl  # not on Windows, where no tab is opened

    copy = fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 10)
    os.close(end)
    return copy


def _start(command: list[str], to_child: int, from_child: int) -> "subprocess.Popen[bytes]":
    def connect() -> None:
        os.dup2(to_child, 3)
        os.dup2(from_child, 4)

    try:
        return subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            preexec_fn=connect,
            close_fds=False,
        )
    except OSError as error:
        raise FileAccessError(f"cannot start {command[0]}: {error.strerror or error}") from error


def _end(process: "subprocess.Popen[bytes]") -> None:
    """End a browser whose pipe is closed, which makes it end by itself."""
    try:
        process.wait(timeout=_GRACE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
