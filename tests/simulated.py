"""The window without a browser: a simulated one, in the same process."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import re

from nicegui import Client
from nicegui.testing.user_simulation import user_simulation

import dforce as df
from dforce.gui.document.document import Document
from dforce.gui.document.session import Session
from dforce.gui.window.pages import Page
from dforce.gui.window.shown import DrawnResult

CASE = "figure-3-air"  # its curve takes some 20 ms


@contextlib.asynccontextmanager
async def window(folder, session=None, unsent=(), live=True):
    """Give a simulated browser and its page; `live` off: no curve follows by itself."""
    pages = []
    if session is None:
        session = Session({}, folder)
        session.document = Document.of(df.example(CASE))

    def root():
        pages.append(Page(session))
        if not live:
            pages[0].view._latest.ask = lambda wanted: None

    gc.freeze()  # NiceGUI's simulation collects garbage twice, and among all that numba has made that takes a second
    async with user_simulation(root=root) as user:
        user.javascript_rules[re.compile("return dforceUnsent")] = lambda match: unsent
        user.javascript_rules[re.compile("return dforceAddress")] = lambda match: ""
        # charts are drawn at once
        user.javascript_rules[re.compile(r'return runMethod\(\d+, "draw"')] = lambda match: True
        await user.open("/")
        try:
            with user.client:
                yield user, pages[0]
        finally:
            session.close()
            # one that is cancelled just when it wakes goes on for ever, by asyncio.wait_for of Python 3.11
            for client in Client.instances.values():
                client.outbox.stop()


def element(user, kind):
    """Return the first element of a kind."""
    with user.client:
        return next(element for element in user.client.elements.values() if isinstance(element, kind))


def send(element, name, args=None):
    """Let the browser's part of an element say something."""
    for listener in [*element._event_listeners.values()]:
        if listener.type == name:
            element._handle_event({"listener_id": listener.id, "args": args})


def show(page, result):
    """Show a result as if it had just been computed, and return its figure."""
    page.view.curve = DrawnResult(page.view.document, result)
    figure = page.view.compose(result)
    page.view.show_beside()
    return figure


def click(page, **point):
    """Click on a point of the main chart, which shows the figure composed last."""
    page.view.main._sent = {page.view.main.revision: page.plots.drawn.figure}
    send(page.view.main, "point", {"revision": page.view.main.revision, **point})


async def until(true, seconds=20.0):
    """Wait for something to become true."""
    async with asyncio.timeout(seconds):
        while not true():
            await asyncio.sleep(0.02)
