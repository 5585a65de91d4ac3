"""One server and few pages for all flows: each page that is opened costs seconds on a busy machine."""

from __future__ import annotations

import os
import urllib.parse

import pytest
from served import Window, chromium, served

from dforce.gui.window.server import find_browser

WAIT = 60_000  # ms; generous, so that a loaded machine is not taken for a defect


@pytest.fixture(scope="session")
def server(tmp_path_factory):
    with served(tmp_path_factory.mktemp("window")) as started:
        yield started


# not for the whole session: Playwright keeps an event loop running, beside which other tests could not use asyncio
@pytest.fixture(scope="module")
def browser():
    pytest.importorskip("playwright")
    if find_browser() is None:
        missing = "no Chromium, Chrome or Edge was found for the tests of the window"
        if os.environ.get("CI"):
            pytest.fail(missing)
        pytest.skip(missing)
    with chromium() as started:
        yield started


# what Chromium says of a connection that is gone
LOST = (
    "ERR_INTERNET_DISCONNECTED",
    "ERR_CONNECTION_REFUSED",
    "ERR_CONNECTION_RESET",
    "ERR_EMPTY_RESPONSE",
    "WebSocket",
)


class Watch:
    """What a page must not do: ask another host, raise an error, or complain in its console.

    Where its connection is lost on purpose, it may complain of that.
    """

    def __init__(self, context, server, lost=False):
        self.server, self.own = server, urllib.parse.urlsplit(server.home).netloc
        self.allowed = LOST if lost else ()
        self.wrong = []
        context.on("request", lambda request: self._request(request.url))
        context.on("weberror", lambda error: self.wrong.append(f"error in the page: {error.error}"))
        context.on("console", lambda message: message.type == "error" and self._complaint(message))

    def _request(self, url):
        parts = urllib.parse.urlsplit(url)
        if parts.scheme not in ("data", "blob", "about") and parts.netloc != self.own:
            self.wrong.append(f"request to another host: {url}")

    def _complaint(self, message):
        if not any(words in message.text for words in self.allowed):
            self.wrong.append(f"console: {message.text}")

    def check(self):
        wrong, self.wrong = self.wrong, []
        assert wrong == [], "".join(self.server.said[-50:])


@pytest.fixture
def visit(browser, server):
    """Give a function that opens the window for another person, by default in the size of a small laptop.

    A test that cuts the connection, or ends the server, says that it is `lost`.
    """
    opened = []

    def visit(server=server, width=1366, height=768, enter=Window.open, lost=False, **options):
        context = browser.new_context(viewport={"width": width, "height": height}, accept_downloads=True, **options)
        context.set_default_timeout(WAIT)
        opened.append((context, Watch(context, server, lost)))
        window = Window(context.new_page(), server)
        enter(window)
        return window

    yield visit
    for context, watch in opened:
        context.close()
        watch.check()


@pytest.fixture(scope="module")
def lasting(browser, server):
    context = browser.new_context(viewport={"width": 1366, "height": 768}, accept_downloads=True)
    context.set_default_timeout(WAIT)
    watch = Watch(context, server)
    window = Window(context.new_page(), server)
    window.open()
    yield window, watch
    context.close()


@pytest.fixture
def window(lasting):
    """Give the page that the tests of a module share, showing the first example."""
    window, watch = lasting
    window.start()
    yield window
    watch.check()
