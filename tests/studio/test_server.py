"""Who is let in by the server of the studio, and how much may be said to it."""

import contextlib
import http.client
import json
import random
import resource
import socket
import threading

import pytest

from elastocal.errors import DeviceError, PlanningError
from elastocal.studio import StudioServer
from elastocal.studio.server import MOST_BYTES
from support.cli import PATIENCE


def news(number, _patience):
    return 7, {"news": number}


def refuse(message):
    raise PlanningError("not on this tooling")


@pytest.fixture(scope="module")
def server():
    told = {"echo": lambda message: {"heard": message}, "refuse": refuse}
    server = StudioServer(told, news)
    server.start()
    yield server
    server.close()


@pytest.fixture
def ask(server):
    """Ask for a path behind the token; headers that are None are left out."""

    def ask(path="", body=None, method=None, token=None, **headers):
        line = http.client.HTTPConnection("127.0.0.1", server.port, timeout=PATIENCE)
        given = {"Host": f"127.0.0.1:{server.port}"}
        if body is not None:
            given |= {"Content-Type": "application/json", "Content-Length": str(len(body))}
        given |= {name.replace("_", "-"): value for name, value in headers.items()}
        method = method or ("GET" if body is None else "POST")
        token = server.token if token is None else token
        line.putrequest(method, f"/{token}/{path}", skip_host=True, skip_accept_encoding=True)
        for name, value in given.items():
            if value is not None:
                line.putheader(name, value)
        line.endheaders(body)
        answer = line.getresponse()
        text = answer.read()
        line.close()
        return answer, text

    return ask


def test_the_address_leads_to_the_page(server, ask):
    assert server.address == f"http://127.0.0.1:{server.port}/{server.token}/"
    answer, text = ask()
    assert answer.status == 200
    assert b"elastocal studio" in text
    policy = answer.headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert "http" not in policy
    assert answer.headers["Referrer-Policy"] == "no-referrer"
    assert answer.headers["X-Frame-Options"] == "DENY"


@pytest.mark.parametrize(
    "name", ["studio.js", "viewer.js", "forms.js", "runs.js", "studio.css", "viewer.css"]
)
def test_the_files_of_the_page_are_there(ask, name):
    answer, text = ask(name)
    assert answer.status == 200
    assert b"http://" not in text.replace(b"http://www.w3.org", b"")
    assert b"https://" not in text


def test_two_starts_have_two_tokens_that_nobody_guesses(server):
    other = StudioServer({}, news)
    other.close()
    assert other.token != server.token
    assert len(server.token) >= 32


@pytest.mark.parametrize("token", ["", "guess", "%", "%C3%A9", "a" * 32])
def test_nothing_is_answered_without_the_token(ask, token):
    for path, body in (("", None), ("news", None), ("echo", b"{}")):
        answer, text = ask(path, body, token=token)
        assert answer.status == 403
        assert text == b"the address needs its token\n"


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:{port}", "127.0.0.1", "localhost.evil:{port}", None, ""]
)
def test_no_other_name_leads_to_the_server(server, ask, host):
    answer, _ = ask(Host=None if host is None else host.format(port=server.port))
    assert answer.status == 421


def test_localhost_is_a_name_of_the_server(server, ask):
    assert ask(Host=f"localhost:{server.port}")[0].status == 200


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "https://127.0.0.1:{port}"},
        {"Origin": "http://127.0.0.1:1"},
        {"Sec_Fetch_Site": "cross-site"},
        {"Sec_Fetch_Site": "same-site"},
    ],
)
def test_a_page_of_another_origin_is_refused(server, ask, headers):
    given = {name: text.format(port=server.port) for name, text in headers.items()}
    for path, body in (("", None), ("echo", b"{}")):
        assert ask(path, body, **given)[0].status == 403


def test_a_file_that_leads_to_the_page_opens_it_and_reads_nothing(ask):
    """As a browser asks that follows a file with the address: with the token, to be shown."""
    shown = {"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "navigate"}
    assert ask("", Sec_Fetch_Dest="document", **shown)[0].status == 200
    assert ask("", Sec_Fetch_Dest="document", token="guess", **shown)[0].status == 403
    assert ask("", Sec_Fetch_Dest="iframe", **shown)[0].status == 403
    assert ask("news", Sec_Fetch_Site="cross-site", Sec_Fetch_Mode="cors")[0].status == 403


def test_the_own_page_is_answered(server, ask):
    answer, text = ask(
        "echo",
        b'{"q": [1]}',
        Origin=f"http://127.0.0.1:{server.port}",
        Sec_Fetch_Site="same-origin",
    )
    assert answer.status == 200
    assert json.loads(text) == {"heard": {"q": [1]}}


def test_a_form_of_another_page_can_send_nothing(ask):
    assert ask("echo", b"{}", Content_Type="text/plain")[0].status == 415
    assert ask("echo", method="OPTIONS")[0].status == 501


def test_messages_are_bounded(ask):
    assert ask("echo", b"{}", Content_Length=str(MOST_BYTES + 1))[0].status == 413
    assert ask("echo", b"{}", Content_Length="9" * 40)[0].status == 413
    assert ask("echo", b"{}", Content_Length=None)[0].status == 411
    assert ask("echo", b"{}", Content_Length="-1")[0].status == 411
    assert ask("echo", b"{}", Content_Length=None, Transfer_Encoding="chunked")[0].status == 411


@pytest.mark.parametrize("body", [b"{", b"NaN", b"[" * 100_000, b"\xff"])
def test_what_is_no_json_is_refused(ask, body):
    assert ask("echo", body)[0].status == 400


def test_a_refusal_of_ours_is_a_line_and_an_unknown_action_is_none(ask):
    answer, text = ask("refuse", b"{}")
    assert answer.status == 422
    assert json.loads(text) == {"refusal": "not on this tooling"}
    assert ask("rm", b"{}")[0].status == 404
    assert ask("../../secret")[0].status == 404


def test_a_page_that_listens_hears_the_news(server, ask):
    with socket.create_connection(("127.0.0.1", server.port), 20) as line:
        host = f"127.0.0.1:{server.port}"
        line.sendall(f"GET /{server.token}/news HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
        heard = b""
        while b'data: {"news": -1}' not in heard:
            more = line.recv(4096)
            assert more, heard
            heard += more
    assert b"text/event-stream" in heard


def test_a_port_that_is_taken_and_a_host_that_is_none_are_refused(server):
    with pytest.raises(DeviceError, match=f"cannot listen on 127.0.0.1:{server.port}: "):
        StudioServer({}, news, port=server.port)
    with pytest.raises(DeviceError, match="--host 'here': must be an address in numbers"):
        StudioServer({}, news, host="here")


@contextlib.contextmanager
def connected(server, *sent):
    with socket.create_connection(("127.0.0.1", server.port), timeout=20) as line:
        for each in sent:
            line.sendall(each)
        yield line


def heard(line):
    """Return what a connection says until it ends."""
    with contextlib.suppress(ConnectionError):
        return b"".join(iter(lambda: line.recv(65536), b""))
    return b""


def test_a_message_that_is_cut_off_is_not_taken(server):
    told = f"POST /{server.token}/echo HTTP/1.1\r\nHost: localhost:{server.port}\r\n"
    told += "Content-Type: application/json\r\nContent-Length: 3\r\n\r\n12"
    with connected(server, told.encode()) as line:
        line.shutdown(socket.SHUT_WR)
        assert b"the message is cut off" in heard(line)


def test_two_lengths_are_none(server):
    told = f"POST /{server.token}/echo HTTP/1.1\r\nHost: localhost:{server.port}\r\n"
    told += "Content-Type: application/json\r\nContent-Length: 2\r\nContent-Length: 3\r\n\r\n{} "
    with connected(server, told.encode()) as line:
        assert heard(line).startswith(b"HTTP/1.1 411")


def test_who_shows_the_token_gets_in_whoever_waits(server, ask):
    with contextlib.ExitStack() as waiting:
        lines = [waiting.enter_context(connected(server, b"GET / HT")) for _ in range(40)]
        for _ in range(3):
            assert ask("echo", b"1")[0].status == 200
        assert heard(lines[0]) == b""


_ODD = (b"", b"\0", b"\xff" * 9, b"9" * 500, b"-1", b"+2", b"0x2", b"2, 2", b"\xd9\xa2", b"[::1")
_NAMES = (b"Upgrade", b"Connection", b"Expect", b"Range", b"Transfer-Encoding", b"Origin", b"\xff")
_VALUES = (b"websocket", b"Upgrade", b"100-continue", b"bytes=0-", b"chunked", b"close", *_ODD)
_PATHS = (b"", b"//[", b"%00", b"..", b"\xff", b"a" * 70_000)
_PAGES = (b"", b"echo", b"news", b"refuse", b"studio.js", b"../server.py", b"?#")
_METHODS = (b"GET", b"POST", b"POST", b"PUT", b"HEAD", b"", b"\x16\x03\x01", b"PRI")
_VERSIONS = (b"HTTP/1.1", b"HTTP/1.1", b"HTTP/1.0", b"HTTP/2.0", b"HTTP/1.x", b"", b"\0")
_ENDS = (b"\r\n", b"\r\n", b"\n", b"\r", b"\r\n ")
_BODIES = (b"{}", b"", b"[" * 5000, b"{", b"\x81\x85" + b"\0" * 20, b"0\r\n\r\n", b"1e999")


def hostile(server, rng):
    """Return a request that no browser sends."""
    path = b"/".join([b"", rng.choice([server.token.encode(), *_PATHS]), rng.choice(_PAGES)])
    lines = [b" ".join([rng.choice(_METHODS), path, rng.choice(_VERSIONS)])]
    good = {b"Host": b"127.0.0.1:%d" % server.port, b"Content-Type": b"application/json"}
    for name, value in (good | {b"Content-Length": b"2"}).items():
        told = rng.choice(_ODD) if rng.random() < 0.2 else value
        lines += [name + b": " + told] * rng.choice([0, 1, 1, 1, 1, 1, 2])
    for _ in range(rng.choice([0, 0, 1, 2, 150])):
        lines.append(rng.choice(_NAMES) + b": " + rng.choice(_VALUES) * rng.choice([1, 1, 1, 3000]))
    end = rng.choice(_ENDS)
    whole = end.join([*lines, b"", rng.choice(_BODIES)])
    return whole[: rng.randrange(len(whole) + 1)] if rng.random() < 0.3 else whole


def bombard(server, seeds):
    """Send what no browser sends, and hang up or wait for an answer."""
    for seed in seeds:
        rng = random.Random(seed)
        with contextlib.suppress(OSError), connected(server, hostile(server, rng)) as line:
            line.shutdown(socket.SHUT_WR)
            if rng.random() < 0.5:
                assert b"Traceback" not in line.recv(65536)


@pytest.mark.parametrize("requests", [150, pytest.param(20_000, marks=pytest.mark.slow)])
def test_what_no_browser_sends_is_answered_or_dropped(server, ask, capfd, monkeypatch, requests):
    fallen = []
    monkeypatch.setattr(threading, "excepthook", fallen.append)
    threads, memory = threading.active_count(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    bombard(server, range(requests))
    assert ask("echo", b'{"q": 1}')[0].status == 200
    assert threading.active_count() <= threads + 33
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - memory < 100_000
    assert (fallen, *capfd.readouterr()) == ([], "", "")
