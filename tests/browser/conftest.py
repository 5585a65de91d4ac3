"""One server, one browser and few pages for all flows: each page that is opened costs seconds."""

from __future__ import annotations

import os
import urllib.parse

import pytest
from served import Window, chromium, served

import dforce as df
from dforce.gui.window.server import find_browser

WAIT = 60_000  # ms; generous, so that a loaded machine is not taken for a defect


@pytest.fixture(scope="session")
def server(tmp_path_factory):
    with served(tmp_path_factory.mktemp("window")) as started:
        yield started


@pytest.fixture(autouse=True)
def no_traceback(server):
    """Fail a test during which the server printed a traceback."""
    before = len(server.said)
    yield
    said = "".join(server.said[before:])
    assert "Traceback" not in said, said


# Not for the whole session: Playwright keeps an event loop running, beside which other tests could not use asyncio.
@pytest.fixture(scope="package")
def browser():
    pytest.importorskip("playwright")
    if find_browser() is None:
        missing = "no Chromium, Chrome or Edge was found for the tests of the window"
        if os.environ.get("CI"):
            pytest.fail(missing)
        pytest.skip(missing)
    from playwright.sync_api import expect

    expect.set_options(timeout=WAIT)
    # no page stays for so long that it pays to compile its scripts once more, to quicker code
    with chromium("--js-flags=--no-opt,--no-maglev") as started:
        yield started


# what Chromium says of a connection that is gone
LOST = (
    "ERR_INTERNET_DISCONNECTED",
    "ERR_CONNECTION_REFUSED",
    "ERR_CONNECTION_RESET",
    "ERR_EMPTY_RESPONSE",
    "WebSocket",
)


class Visitor:
    """A page, and what it must not do: ask another host, raise an error, or complain in its console.

    Where its connection is lost on purpose, it may complain of that.
    """

    def __init__(self, browser):
        # nothing moves by itself: what is drawn sixty times a second costs more than all that is looked at
        context = browser.new_context(accept_downloads=True, reduced_motion="reduce")
        context.set_default_timeout(WAIT)
        context.on("request", lambda request: self._request(request.url))
        context.on("weberror", lambda error: self.wrong.append(f"error in the page: {error.error}"))
        context.on("console", lambda message: message.type == "error" and self._complaint(message))
        self.page, self.wrong = context.new_page(), []

    def come(self, server, width=1366, height=768, lost=False):
        """Come to a server that does not know this person, by default with the screen of a small laptop."""
        self.server, self.own = server, urllib.parse.urlsplit(server.home).netloc
        self.allowed = LOST if lost else ()
        self.wrong.clear()
        self.page.set_viewport_size({"width": width, "height": height})
        return Window(self.page, server)

    def leave(self):
        """Leave nothing for the next person, and return whether there can be one."""
        if self.server.process.poll() is not None:
            self.page.context.close()
            return False
        for page in self.page.context.pages:
            if page != self.page:
                page.close()
        self.page.mouse.move(0, 0)
        self.page.goto(f"{self.server.home}/favicon.ico")
        self.page.evaluate("() => [localStorage, sessionStorage].forEach((one) => one.clear())")
        # requests under way need the cookie: without it the server refuses them
        self.page.wait_for_load_state("networkidle")
        self.page.context.clear_cookies()
        return True

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


@pytest.fixture(scope="package")
def free():
    """Keep visitors who have left: with its scripts compiled, a page opens the window at half the cost."""
    return []


@pytest.fixture
def visit(browser, free, server):
    """Give a function that opens the window for another person.

    A test that cuts the connection, or ends the server, says that it is `lost`.
    """
    here = []

    def visit(server=server, enter=Window.open, **how):
        here.append(free.pop() if free else Visitor(browser))
        window = here[-1].come(server, **how)
        enter(window)
        return window

    yield visit
    for visitor in here:
        visitor.check()
        free.extend([visitor] * visitor.leave())


@pytest.fixture(scope="module")
def lasting(browser, free, server):
    visitor = free.pop() if free else Visitor(browser)
    window = visitor.come(server)
    window.open()
    yield window, visitor
    free.extend([visitor] * visitor.leave())


@pytest.fixture
def window(lasting):
    """Give the page that the tests of a module share, showing an example as it was opened."""
    window, visitor = lasting
    case = df.example("figure-3-air")
    if window.holds(case):
        window.shows(case)
    else:
        window.start("figure-3-air")
    yield window
    visitor.check()
