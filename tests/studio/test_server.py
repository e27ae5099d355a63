"""Who is let in by the server of the studio, and how much may be said to it."""

import http.client
import json
import socket

import pytest

from elastocal.errors import DeviceError, PlanningError
from elastocal.studio import MOST_BYTES, StudioServer
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


@pytest.mark.parametrize("name", ["studio.js", "view.js", "forms.js", "runs.js", "studio.css"])
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
