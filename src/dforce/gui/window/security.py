"""Who may ask this server for something: a secret in the address, the right Host and Origin, nothing too large.

Any web page may send requests to this computer, and open a WebSocket to it: so each request is checked.
"""

from __future__ import annotations

import hmac
import math
import os
import secrets
import urllib.parse
from collections.abc import Awaitable, Callable, Iterator, MutableMapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import dforce as df
from dforce.core.parameters import Parameters

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

KEY = "key"  # of the secret in the address
GUEST = "dforce.guest"  # in the scope of a request: whether it comes from a guest of a class
MOST_BYTES = 50_000_000  # of a request
TOO_LARGE = f"This is larger than {MOST_BYTES // 1_000_000} MB, the limit of this server."
NO_KEY = "Open the complete address that dForce printed at its start: this address lacks its key."
WRONG_CODE = "This is not the address of this class: check each letter. Each start of dForce has a new address."
POLICY = "; ".join(
    (
        "default-src 'self'",
        "script-src 'self' 'unsafe-inline' 'unsafe-eval'",  # Vue compiles its templates in the browser
        "style-src 'self' 'unsafe-inline'",
        "img-src 'self' data: blob:",
        "font-src 'self' data:",
        "connect-src 'self'",
        "worker-src 'self' blob:",
        "object-src 'none'",
        "base-uri 'self'",
        "form-action 'self'",
        "frame-ancestors 'none'",
    )
)
HEADERS = (
    (b"content-security-policy", POLICY.encode()),
    (b"referrer-policy", b"no-referrer"),
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"DENY"),
)


def kept_secret(file: Path) -> str:
    """Return the secret in a file that only its owner may read; it is made at the first call.

    It stays the same over a restart, so that a page that is open finds its server again.
    """
    file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    try:
        found = file.read_text(encoding="ascii").strip()
        if len(found) >= 32:
            return found
        file.unlink()
    except FileNotFoundError:
        pass
    secret = secrets.token_urlsafe(32)
    with os.fdopen(os.open(file, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600), "w", encoding="ascii") as stream:
        stream.write(secret)
    return secret


class _Headers:
    """The headers of a request, as text."""

    def __init__(self, scope: Scope) -> None:
        self.pairs = [(key.decode("latin-1").lower(), value.decode("latin-1")) for key, value in scope["headers"]]

    def all(self, name: str) -> list[str]:
        """Return the values of a header that may come several times."""
        return [value for key, value in self.pairs if key == name]

    def only(self, name: str) -> str | None:
        """Return the value of a header, empty where there is none; None where there are several."""
        found = self.all(name)
        return None if len(found) > 1 else "".join(found)


class Guard:
    """Lets through requests from a page of this server itself.

    Parameters
    ----------
    app
        The guarded application.
    secret
        The key that the address must contain, ``/?key=SECRET``; a cookie remembers it.
    cookie
        Name of that cookie.
    hosts
        Allowed values of the header Host; empty: any, for a server that is open to others.
    code
        The path of the short address of a class, without its slash; empty where there is none. Its guests get another
        secret, which opens no page of the teacher.
    """

    def __init__(self, app: App, secret: str, cookie: str, hosts: frozenset[str] = frozenset(), code: str = "") -> None:
        self.app, self.secret, self.cookie, self.hosts, self.code = app, secret, cookie, hosts, code
        self.guests = hmac.new(secret.encode(), code.encode(), "sha256").hexdigest() if code else ""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check a request, then pass it on."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = _Headers(scope)
        wrong = self._wrong(headers)
        if wrong:
            await _refuse(scope, send, 403, wrong)
        elif self._in_address(scope):
            await self._remember(scope, send, self.secret)
        elif self.code and scope["type"] == "http" and _same(scope.get("path", "").strip("/").lower(), self.code):
            known = self._in_cookie(headers, self.secret)  # a teacher who looks at the class's address stays one
            await self._remember({**scope, "path": "/"}, send, self.secret if known else self.guests)
        elif not self._is_known(scope, headers):
            await _refuse(scope, send, 403, WRONG_CODE if self.code else NO_KEY)
        elif _size(headers) > MOST_BYTES:
            await _refuse(scope, send, 413, TOO_LARGE)
        elif scope["type"] == "websocket":
            await self.app(scope, receive, _with_headers(send))
        else:
            await self._pass_on(scope, receive, send)

    async def _pass_on(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on a request; one that breaks off, or has no end, is nothing for the one who started the server to read."""
        from starlette.requests import ClientDisconnect

        body = _Body(receive)
        # some handlers take a request apart before they check that there is one
        if await body.is_there():
            try:
                await self.app(scope, body.receive, _with_headers(send))
                return
            except ClientDisconnect:
                pass
        if body.size > MOST_BYTES:
            await _refuse(scope, send, 413, TOO_LARGE)
        else:
            await _refuse(scope, send, 400, "This request is incomplete.")

    def _wrong(self, headers: _Headers) -> str:
        host, origin = headers.only("host"), headers.only("origin")
        if host is None or origin is None:
            return "This request has a header twice, unlike any browser."
        if self.hosts and host.lower() not in self.hosts:
            return "This server answers only under the address that dForce printed at its start."
        # compared as text: an origin that is no address must not be taken apart
        if origin and origin.lower() not in (f"http://{host.lower()}", f"https://{host.lower()}"):
            return "This request comes from another page."
        return ""

    def _in_address(self, scope: Scope) -> bool:
        query = urllib.parse.parse_qs(scope.get("query_string", b"").decode("latin-1"))
        return scope["type"] == "http" and _same(query.get(KEY, [""])[0], self.secret)

    def _is_known(self, scope: Scope, headers: _Headers) -> bool:
        """Return whether a request has a cookie of ours, and note in its scope whether it is a guest's."""
        scope[GUEST] = not self._in_cookie(headers, self.secret)
        return not scope[GUEST] or (bool(self.code) and self._in_cookie(headers, self.guests))

    def _in_cookie(self, headers: _Headers, secret: str) -> bool:
        """Return whether one of the cookies has this secret; cookies of other programs on this computer come along."""
        # http.cookies gives up at the first wrong cookie of any program
        pairs = (part.partition("=") for line in headers.all("cookie") for part in line.split(";"))
        return any(name.strip() == self.cookie and _same(value.strip(), secret) for name, _, value in pairs)

    async def _remember(self, scope: Scope, send: Send, secret: str) -> None:
        """Send the browser to the address without the secret, which a cookie then holds."""
        cookie = f"{self.cookie}={secret}; Path=/; HttpOnly; SameSite=Lax; Max-Age=31536000"
        target = urllib.parse.quote(scope.get("path", "/"))
        location = "/" + target.lstrip("/\\")  # never another host
        headers = [(b"location", location.encode("ascii")), (b"set-cookie", cookie.encode("ascii")), *HEADERS]
        await send({"type": "http.response.start", "status": 303, "headers": [*headers, (b"content-length", b"0")]})
        await send({"type": "http.response.body", "body": b""})


def _same(given: str, wanted: str) -> bool:
    return hmac.compare_digest(given.encode("utf-8", "replace"), wanted.encode())


def _size(headers: _Headers) -> int:
    length = headers.only("content-length") or ("x" if headers.all("content-length") else "0")
    return int(length) if length.isdecimal() and len(length) < 19 else MOST_BYTES + 1


async def _refuse(scope: Scope, send: Send, status: int, text: str) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 1008})
        return
    body = text.encode()
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"content-length", str(len(body)).encode()), *HEADERS]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})


class _Body:
    """The body of a request, which is cut off if it has no length and does not stop.

    Attributes
    ----------
    size
        Bytes received.
    """

    def __init__(self, receive: Receive) -> None:
        self.size = 0
        self._receive = receive
        self._first: Message | None = None

    async def is_there(self) -> bool:
        """Wait for the first part; return False when the connection ends before it."""
        self._first = await self._receive()
        return bool(self._first["type"] == "http.request")

    async def receive(self) -> Message:
        """Return the next part."""
        first, self._first = self._first, None
        message = first if first is not None else await self._receive()
        if message["type"] == "http.request":
            self.size += len(message.get("body", b""))
            if self.size > MOST_BYTES:
                return {"type": "http.disconnect"}
        return message


def _with_headers(send: Send) -> Send:
    async def sent(message: Message) -> None:
        if message["type"] == "http.response.start":
            message = {**message, "headers": [*message.get("headers", []), *HEADERS]}
        await send(message)

    return sent


# costs time, which is limited by itself, and no memory unless all of the motion is recorded
TIME_ALONE = ("solver.max_periods", "solver.periods", "solver.measured_periods")


@dataclass(frozen=True)
class Limits:
    """Limits for each session.

    Attributes
    ----------
    seconds
        Time that a run may take; its points so far are kept.
    count
        Largest whole number in an experiment or for the solver that costs memory: points, periods recorded, samples.
    """

    seconds: float = math.inf
    count: float = math.inf

    def check(self, case: df.Case) -> df.Case:
        """Return the case.

        Raises
        ------
        ParameterError
            When it asks for more than the limits allow.
        """
        free = TIME_ALONE if getattr(case.experiment, "record", "") != "all" else ()
        for section in ("experiment", "solver"):
            given = getattr(case, section)
            for path, number in _whole_numbers(given, section) if given is not None else ():
                if number > self.count and path not in free:
                    raise df.ParameterError(f"{path} = {number} is above {self.count:.0f}, the limit of this server")
        return case


ALONE = Limits()
"""Of a server on one's own computer: none."""

SHARED = Limits(seconds=300.0, count=2000)
"""Of a server that is open to others; the longest trace that they allow takes some 200 MB while it is computed."""


def _whole_numbers(given: Parameters, path: str) -> Iterator[tuple[str, int]]:
    """Give the whole numbers typed into a table of parameters and into its inner tables; defaults are fine."""
    for key in given.model_fields_set:
        value: Any = getattr(given, key)
        if isinstance(value, Parameters):
            yield from _whole_numbers(value, f"{path}.{key}")
        elif isinstance(value, int) and not isinstance(value, bool):
            yield f"{path}.{key}", value
        elif isinstance(value, tuple):
            yield f"{path}.{key}", len(value)
