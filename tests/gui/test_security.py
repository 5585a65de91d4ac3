"""Who may ask the window's server for something."""

from __future__ import annotations

import asyncio
import stat
import sys

import pytest

from dforce.gui.security import MOST_BYTES, Guard, kept_secret

SECRET = "s" * 43
HOST = "127.0.0.1:8571"


async def inner(scope, receive, send):
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b"inside"})


def ask(headers, *, query="", kind="http", path="/"):
    """Return what the guard sends for a request."""
    sent = []

    async def send(message):
        sent.append(message)

    async def receive():
        return {"type": "http.request", "body": b""}

    scope = {
        "type": kind, "path": path, "query_string": query.encode(),
        "headers": [(key.encode(), value.encode()) for key, value in headers.items()],
    }  # fmt: skip
    guard = Guard(inner, SECRET, "dforce-8571", frozenset({HOST}))
    asyncio.run(guard(scope, receive, send))
    return sent


KNOWN = {"host": HOST, "cookie": f"dforce-8571={SECRET}"}


def test_a_page_with_the_cookie_is_let_through_with_a_policy():
    start = ask(KNOWN | {"origin": f"http://{HOST}"})[0]
    assert start["status"] == 200
    assert b"default-src 'self'" in dict(start["headers"])[b"content-security-policy"]


@pytest.mark.parametrize(
    "headers",
    [
        {"host": HOST},
        {"host": HOST, "cookie": "dforce-8571=wrong"},
        {"host": HOST, "cookie": f"other={SECRET}"},
        KNOWN | {"host": "evil.example:8571"},
        KNOWN | {"origin": "http://evil.example"},
        KNOWN | {"origin": "null"},
        KNOWN | {"origin": "http://127.0.0.1:9999"},
    ],
)
@pytest.mark.parametrize("kind", ["http", "websocket"])
def test_every_other_request_is_refused(headers, kind):
    start = ask(headers, kind=kind)[0]
    assert start == {"type": "websocket.close", "code": 1008} if kind == "websocket" else start["status"] == 403


def test_the_secret_in_the_address_becomes_a_cookie_that_scripts_cannot_read():
    start = ask({"host": HOST}, query=f"key={SECRET}")[0]
    headers = dict(start["headers"])
    assert start["status"] == 303
    assert headers[b"location"] == b"/"
    assert b"HttpOnly" in headers[b"set-cookie"]


def test_the_way_back_from_the_address_stays_on_this_server():
    start = ask({"host": HOST}, query=f"key={SECRET}", path="//evil.example/x")[0]
    assert dict(start["headers"])[b"location"] == b"/evil.example/x"


@pytest.mark.parametrize("length", [str(MOST_BYTES + 1), "9" * 30, "-1", "x"])
def test_a_request_that_is_too_large_is_refused(length):
    assert ask(KNOWN | {"content-length": length})[0]["status"] == 413


def test_the_secret_stays_and_only_its_owner_may_read_it(tmp_path):
    file = tmp_path / "new" / "secret"
    assert kept_secret(file) == kept_secret(file)
    if sys.platform != "win32":
        assert stat.S_IMODE(file.stat().st_mode) == 0o600
