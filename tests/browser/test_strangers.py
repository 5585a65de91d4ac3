"""Who is not let in, and what nobody gets: over the wire, as a stranger would try it."""

from __future__ import annotations

import base64
import http.client
import os
import socket
import urllib.parse

import pytest


def ask(server, path="/", method="GET", headers=None, body=None, known=True):
    """Return status, headers and body of an answer."""
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=60)
    given = {"Cookie": cookie(server)} if known else {}
    try:
        connection.request(method, path, body, given | (headers or {}))
        answer = connection.getresponse()
        return answer.status, dict(answer.getheaders()), answer.read()
    finally:
        connection.close()


def cookie(server):
    """Return the cookie that a browser has once it was at the address that the server printed."""
    key = urllib.parse.parse_qs(urllib.parse.urlsplit(server.address).query)["key"][0]
    return f"dforce-{server.port}={key}"


def test_who_has_the_address_is_let_in(server):
    key = urllib.parse.urlsplit(server.address).query
    status, headers, _ = ask(server, f"/?{key}", known=False)
    assert (status, headers["location"]) == (303, "/")
    status, headers, body = ask(server)
    assert status == 200
    assert b"dForce" in body
    assert "default-src 'self'" in headers["content-security-policy"]


@pytest.mark.parametrize(
    ("path", "headers", "known"),
    [
        ("/", {}, False), ("/?key=wrong", {}, False), ("/assets/style.css", {}, False), ("/_nicegui_ws/socket.io/", {}, False),
        ("/", {"Host": "evil.example"}, True), ("/", {"Host": "evil.example:80", "X-Forwarded-Host": "127.0.0.1"}, True),
        ("/", {"Origin": "http://evil.example"}, True), ("/", {"Origin": "null"}, True),
        ("/", {"Origin": "http://["}, True),
    ],
)  # fmt: skip
def test_a_stranger_is_refused(server, path, headers, known):
    assert ask(server, path, headers=headers, known=known)[0] == 403


@pytest.mark.parametrize("other", ['prefs={"a":1}', "a[b]=c", "flag", "path=/x", "n=J\xf6rg", 'sid=a b"c', 'q="'])
def test_cookies_of_another_program_on_this_computer_lock_nobody_out(server, other):
    headers = {"Cookie": f"{other}; {cookie(server)}; {other}"}
    assert ask(server, headers=headers, known=False)[0] == 200


def knock(server, origin):
    """Ask for a WebSocket, and return the status of the answer."""
    key = base64.b64encode(os.urandom(16)).decode()
    lines = [
        "GET /_nicegui_ws/socket.io/?EIO=4&transport=websocket HTTP/1.1", f"Host: 127.0.0.1:{server.port}",
        f"Cookie: {cookie(server)}", f"Origin: {origin}", "Upgrade: websocket", "Connection: Upgrade",
        f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13", "", "",
    ]  # fmt: skip
    with socket.create_connection(("127.0.0.1", server.port), timeout=60) as wire:
        wire.sendall("\r\n".join(lines).encode())
        return int(wire.recv(1024).split()[1])


def test_a_web_page_of_another_host_gets_no_websocket(server):
    assert knock(server, server.home) == 101
    assert knock(server, "http://evil.example") == 403
    assert knock(server, f"http://127.0.0.1:{server.port + 1}") == 403


@pytest.mark.parametrize(
    "path",
    [
        "/../secret", "/assets/../secret", "/assets/%2e%2e/%2e%2e/secret", "/assets/..%2f..%2fsecret", "//secret", "/secret",
        "/sessions/", "/results/", "/_nicegui/../secret", "/assets/style.css/../../secret", "/%00", "/assets/pages.py",
    ],
)  # fmt: skip
def test_no_path_leads_to_a_file_of_the_server(server, path):
    secret = (server.folder / "secret").read_bytes()
    status, _, body = ask(server, path)
    assert status in (400, 404, 405)
    assert secret not in body
    assert b"from __future__" not in body


def test_a_hundred_megabytes_are_not_taken(server):
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=60)
    try:
        connection.putrequest("POST", "/upload")
        connection.putheader("Cookie", cookie(server))
        connection.putheader("Content-Length", str(100_000_000))
        connection.endheaders()
        assert connection.getresponse().status == 413
    finally:
        connection.close()


@pytest.mark.parametrize("sent", [b"", b"zz\r\n", b"5\r\nhello\r\n"])
@pytest.mark.parametrize("path", ["/_nicegui_ws/socket.io/?EIO=4&transport=polling", "/", "/upload"])
def test_a_request_that_breaks_off_leaves_no_traceback(server, path, sent):
    lines = [
        f"POST {path} HTTP/1.1", f"Host: 127.0.0.1:{server.port}", f"Cookie: {cookie(server)}",
        "Transfer-Encoding: chunked", "", "",
    ]  # fmt: skip
    with socket.create_connection(("127.0.0.1", server.port), timeout=60) as wire:
        wire.sendall("\r\n".join(lines).encode() + sent)
        wire.shutdown(socket.SHUT_WR)
        wire.recv(100)  # what is answered, or the end
    assert ask(server)[0] == 200  # and with it what the request before left on the terminal: `no_traceback` reads it


def test_what_the_server_keeps_is_for_its_owner_alone(server):
    kept = [server.folder, *(file for file in server.folder.rglob("*") if "secret" in file.name or file.is_dir())]
    if os.name == "posix":
        assert [str(one) for one in kept if one.stat().st_mode & 0o077 and one.parent == server.folder] == []
