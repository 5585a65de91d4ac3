"""Who may ask the window's server for something."""

from __future__ import annotations

import asyncio
import itertools
import stat
import sys

import pytest
from every import every
from starlette.requests import Request

from dforce.gui.window.security import MOST_BYTES, Guard, kept_secret

SECRET = "s" * 43
HOST = "127.0.0.1:8571"


async def inner(scope, receive, send):
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b"inside"})


def ask(headers, *, query="", kind="http", path="/"):
    """Return what the guard sends for a request, whose headers are a dict or, where one comes twice, pairs."""
    sent = []

    async def send(message):
        sent.append(message)

    async def receive():
        return {"type": "http.request", "body": b""}

    scope = {
        "type": kind, "path": path, "query_string": query.encode(),
        "headers": [
            (key.encode(), value if isinstance(value, bytes) else value.encode())
            for key, value in (headers.items() if isinstance(headers, dict) else headers)
        ],
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


OURS = f"dforce-8571={SECRET}"
FOREIGN = [
    'prefs={"a":1}', "a[b]=c", "flag", "path=/x", "n=Jörg", 'sid=a b"c', "", " ", "=", "==", "=x", "a=", ",", "a,b=c",
    "a=b,c", '"', 'a="', 'a="x', "a='x", 'a="x\\"', "a=\\", "a=\\073", "a=\x01", "a=\x7f", "a=\t", "@=1", "(a)=1", "a/b=c",
    "{}={}", "[]", "<a>=<b>", "a:b=c", "é=é", "\u65e5\u672c=\u8a9e", "a=%00", "a=b=c", "$Version=1", "$Path=/",
    "expires=Thu, 01 Jan 1970 00:00:00 GMT", "domain=evil.example", "HttpOnly", "Secure", "SameSite=None", "Max-Age=0",
    "dforce-8571", "dforce-8571=", "dforce-8571=stale", "dforce-85710=x", f"dforce-8572={'t' * 43}", "dforce-session-8571=x",
    "x=" + "y" * 50_000, "; ".join(f"c{n}={n}" for n in range(1000)), ";;;", "a=1,dforce-8571=x", "a=b\\; c=d",
]  # fmt: skip


ORDERS = ("{other}; {ours}", "{ours}; {other}", "{other};{ours}", "{other}; {ours}; {other}")


@every(itertools.product(FOREIGN, ORDERS), repr)
def test_cookies_of_other_programs_lock_nobody_out(other, order):
    cookie = order.format(other=other, ours=OURS)
    assert ask({"host": HOST, "cookie": cookie})[0]["status"] == 200
    assert ask({"host": HOST, "cookie": cookie.replace(SECRET, "t" * 43)})[0]["status"] == 403


def test_cookies_in_several_headers_count_together():
    for cookies in (["x", OURS], [OURS, "x"], ["dforce-8571=stale", OURS]):
        assert ask([("host", HOST), *(("cookie", cookie) for cookie in cookies)])[0]["status"] == 200


def test_bytes_that_are_no_text_in_a_cookie_lock_nobody_out():
    assert ask({"host": HOST, "cookie": b"n=\xff\xfe; " + OURS.encode()})[0]["status"] == 200


@every(
    itertools.product(
        [
            "http://[",
            "http://]",
            "http://[::1",
            "http://[x]",
            "http://a[b]",
            "http://127.0.0.1:x",
            "http://127.0.0.1:99999999",
            f"http://{HOST}@evil.example",
            f"http://evil.example/{HOST}",
            f"http://evil.example#{HOST}",
            f"//{HOST}",
            HOST,
            "http://",
            "http://127.0.0.1:8571\u2100",
            "http://\u2100",
            "\x00",
            " ",
            "*",
            "x" * 100_000,
            f"ftp://{HOST}",
            f"http://{HOST}/",
            f"http://{HOST}, http://evil.example",
        ],
        ["http", "websocket"],
    )
)
def test_an_origin_that_is_no_address_of_this_page_is_refused(origin, kind):
    start = ask(KNOWN | {"origin": origin}, kind=kind)[0]
    assert start == {"type": "websocket.close", "code": 1008} if kind == "websocket" else start["status"] == 403


@pytest.mark.parametrize(
    "host", ["[", "http://[", "127.0.0.1:x", "", "\x00", f"{HOST}@evil.example", "127.0.0.1:8571\u2100"]
)
def test_a_host_that_is_no_address_is_refused(host):
    assert ask(KNOWN | {"host": host})[0]["status"] == 403
    assert ask(KNOWN | {"host": host, "origin": f"http://{host}"})[0]["status"] == 403


@pytest.mark.parametrize("twice", [("host", "evil.example"), ("host", HOST), ("origin", "http://evil.example")])
def test_a_header_that_decides_comes_once(twice):
    pairs = [*(KNOWN | {"origin": f"http://{HOST}"}).items()]
    assert ask([*pairs, twice])[0]["status"] == 403
    assert ask([twice, *pairs])[0]["status"] == 403


@pytest.mark.parametrize(
    "query", ["key", "key=", "key=%", "key=%ff%fe", "key=\x00", "&" * 5000, "key[]=x", "=", "key=é"]
)
def test_a_query_that_is_no_secret_opens_nothing(query):
    assert ask({"host": HOST}, query=query)[0]["status"] == 403


@pytest.mark.parametrize("length", [str(MOST_BYTES + 1), "9" * 30, "-1", "x"])
def test_a_request_that_is_too_large_is_refused(length):
    assert ask(KNOWN | {"content-length": length})[0]["status"] == 413


def test_the_secret_stays_and_only_its_owner_may_read_it(tmp_path):
    file = tmp_path / "new" / "secret"
    assert kept_secret(file) == kept_secret(file)
    if sys.platform != "win32":
        assert stat.S_IMODE(file.stat().st_mode) == 0o600


async def reader(scope, receive, send):
    """Read the whole body, as what takes files does."""
    body = await Request(scope, receive).body()
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": str(len(body)).encode()})


def part(size, more=True):
    return {"type": "http.request", "body": b"x" * size, "more_body": more}


END = {"type": "http.disconnect"}


@pytest.mark.parametrize(
    ("parts", "status"),
    [
        ([END], 400),
        ([part(10), END], 400),
        ([part(10), part(10, more=False)], 200),
        ([part(MOST_BYTES // 2)] * 3 + [END], 413),
        ([part(MOST_BYTES + 1)] * 2, 413),
    ],
)
def test_a_body_that_breaks_off_or_does_not_stop_is_answered_and_raises_nothing(parts, status):
    sent, waiting = [], list(parts)

    async def send(message):
        sent.append(message)

    async def receive():
        return waiting.pop(0)

    headers = [(key.encode(), value.encode()) for key, value in KNOWN.items()]
    scope = {"type": "http", "method": "POST", "path": "/upload", "query_string": b"", "headers": headers}
    asyncio.run(Guard(reader, SECRET, "dforce-8571", frozenset({HOST}))(scope, receive, send))
    assert [message["status"] for message in sent if message["type"] == "http.response.start"] == [status]
