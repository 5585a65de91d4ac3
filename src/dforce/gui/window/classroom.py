"""A class at one server: a short address for guests, their limits, and the teacher's page of guests."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from nicegui import app, ui
from nicegui.elements.mixins.text_element import TextElement
from starlette.requests import Request

from dforce.core.errors import shorten
from dforce.core.progress import duration
from dforce.gui.document.session import Session
from dforce.gui.window.address import to_link
from dforce.gui.window.security import GUEST, Limits

LETTERS = "abcdefghjkmnpqrstuvwxyz23456789"  # none that is mistaken for another when it is read from a wall
LENGTH = 8  # letters of a code: 8e11 of them
LONGEST = 60  # characters of a person's name
LOOKED_EVERY = 2.0  # s between two looks of the teacher's page
PAGE = "/class"
CASE_PAGE = "/class/case"  # of a guest's case, beside the teacher's own
FOR_TEACHERS = "This page is for the teacher. The teacher's address is in the terminal."


def new_code() -> str:
    """Return the end of a short address, which nobody guesses."""
    return "".join(secrets.choice(LETTERS) for _ in range(LENGTH))


def limits_in_words(limits: Limits) -> str:
    """Return words for the limits of each guest."""
    return (
        f"A run may take {duration(limits.seconds)} and have {limits.count:.0f} points. "
        "Cases cannot read files of this server. Your input and results stay here for you alone; the teacher sees your case."
    )


@dataclass(frozen=True)
class Classroom:
    """A class: the address that guests type or scan, and their limits.

    Attributes
    ----------
    address
        The short address.
    limits
        Limits of each guest.
    """

    address: str
    limits: Limits

    def welcome(self, session: Session) -> None:
        """Show a guest the limits before anything is computed, and ask for a name; it is kept for the next visit."""
        session.person = str(app.storage.user.get("person", ""))
        if session.person:
            return
        with ui.element("section").classes("df-class-bar").props('aria-label="class"') as bar:
            ui.label(f"You are in a class. {limits_in_words(self.limits)}").classes("df-text")
            name = ui.input("Your name", value=session.person).props(f"dense outlined maxlength={LONGEST}")

            def take() -> None:
                session.person = app.storage.user["person"] = shorten(str(name.value or "").strip(), LONGEST)
                bar.delete()

            name.on("keydown.enter", take)
            TextElement(tag="button", text="Join").classes("df-plain").props('type="button"').on("click", take)

    def register(
        self, sessions: Mapping[str, Session], dress: Callable[[], object], show_case: Callable[[int], object]
    ) -> None:
        """Make the teacher's pages known; `dress` gives one the looks of the window, `show_case` shows the case of a guest."""

        def is_teacher(request: Request) -> bool:
            guest = bool(request.scope.get(GUEST, True))
            if guest:
                dress()
                ui.label(FOR_TEACHERS).classes("df-banner").props('role="alert"')
            return not guest

        @ui.page(PAGE, title="Class: dForce")
        def page(request: Request) -> None:
            if is_teacher(request):
                dress()
                self._page(sessions)

        @ui.page(CASE_PAGE, title="Case of a guest: dForce")
        def case(request: Request, guest: int) -> None:
            if is_teacher(request):
                show_case(guest)

    def invitation(self) -> None:
        """Show the address as a QR code and as text."""
        import segno

        code = segno.make(self.address).svg_inline(omitsize=True, dark="#000", light="#fff")
        ui.html(code, sanitize=False).props(f'role="img" aria-label="QR code of {self.address}"')
        place, slash, code = self.address.removeprefix("http://").rpartition("/")
        with ui.element("div").classes("df-class-address"):
            ui.label(f"{place}{slash}")
            ui.label(code)  # a line is broken before it, never within

    def _page(self, sessions: Mapping[str, Session]) -> None:
        with ui.element("div").classes("df-class"):
            with ui.element("section").props('aria-label="how to join"'):
                ui.label("Join the class").classes("df-class-title").props('role="heading" aria-level="1"')
                self.invitation()
                ui.label(limits_in_words(self.limits)).classes("df-text")
            with ui.element("section").props('aria-label="who is there"'):
                count = ui.label().classes("df-class-title").props('role="heading" aria-level="2"')
                rows = ui.element("div").classes("df-class-people").props('role="list"')
        shown: list[tuple[str, str, str, int, str]] = []

        def look() -> None:
            now = people(sessions)
            if now == shown and count.text:
                return
            shown[:] = now
            count.set_text(f"{len(now)} here" if now else "Nobody is here yet")
            rows.clear()
            with rows:
                for name, title, state, number, link in now:
                    with ui.element("div").classes("df-class-person").props('role="listitem"'):
                        ui.label(name).classes("df-class-name")
                        ui.label(title)
                        ui.label(state).classes("df-text")
                        ui.link("Open this case", f"{CASE_PAGE}?guest={number}#{link}", new_tab=True).props(
                            f'aria-label="open the case of {name}"'
                        )

        look()
        ui.timer(LOOKED_EVERY, look)


def people(sessions: Mapping[str, Session]) -> list[tuple[str, str, str, int, str]]:
    """Return of each guest whose page is open: name, title of the case, state, number, and the case as the end of a link."""
    found = []
    guests = [session for session in list(sessions.values()) if session.person is not None]
    for number, session in enumerate(guests, 1):
        if not session.views:
            continue
        busy = session.job is not None and session.job.busy
        name = session.person or f"Guest {number}"
        title = session.document.title or "Untitled"
        found.append((name, title, "computing" if busy else "", number, to_link(session.document)))
    return sorted(found)
