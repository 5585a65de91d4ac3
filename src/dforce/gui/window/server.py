"""Starts the window: address, storage, guard, and a browser to show it."""

from __future__ import annotations

import contextlib
import gc
import importlib
import os
import shutil
import socket
import subprocess
import sys
import threading
import time
import webbrowser
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import dforce as df
from dforce.core import files
from dforce.core.errors import shorten
from dforce.core.places import user_folder
from dforce.gui.document.document import Document
from dforce.gui.window.security import ALONE, KEY, SHARED, Guard, kept_secret

if TYPE_CHECKING:
    import uvicorn
    import xarray as xr

PORT = 8571  # tried first, so that an open page finds its server again after a restart
OWN = "127.0.0.1"
# listening there is listening everywhere; packets to these far addresses, reserved for documentation, go to the network
EVERYWHERE = {"0.0.0.0": (socket.AF_INET, "192.0.2.1"), "::": (socket.AF_INET6, "2001:db8::1")}
RECONNECT = 45.0  # s that a page may be without connection before it starts anew from the stored document
STARTS_WITHIN = 2.0  # s in which a browser that cannot start, without a screen say, gives up
SWITCH = 0.0005  # s; Python's own 0.005 makes each of a page's many short steps wait ten times as long
# of the garbage collector; a full collection stops all pages, 30 of them for half a second, and Python makes ten times as many
THRESHOLDS = (700, 10, 100)
BROWSERS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "microsoft-edge",
    "msedge",
    "chrome",
    "brave-browser",
)
PLACES = (  # of everyone on this computer, then of one person
    *(f"{root}Applications/{name}.app/Contents/MacOS/{name}" for root in ("/", "~/") for name in (
        "Google Chrome", "Microsoft Edge", "Chromium"
    )),
    *(rf"{root}\{name}" for root in (r"C:\Program Files (x86)", r"C:\Program Files", r"~\AppData\Local") for name in (
        r"Microsoft\Edge\Application\msedge.exe", r"Google\Chrome\Application\chrome.exe"
    )),
)  # fmt: skip


@dataclass(frozen=True)
class Options:
    """How the window is started.

    Attributes
    ----------
    host
        Address to listen at; others than this computer's own open the server to a class.
    port
        Port; None for the usual one or, where that is taken, a free one.
    show
        How to show it: "browser", "window" (without a browser's bars) or "no".
    case
        A case to open, None for where the last visit ended.
    file
        The file that the case is from; the first page lists it among the last files.
    folder
        Where documents and results are kept; None for the user's data folder.
    over
        A result over parameters to look at: a plan, a sweep, or a store, which is read as far as it is looked at.
    """

    host: str = OWN
    port: int | None = None
    show: str = "browser"
    case: df.Case | None = None
    file: Path | None = None
    folder: Path | None = None
    over: xr.Dataset | None = None


def data_folder() -> Path:
    """Return the folder where the window keeps documents, results and its secret."""
    return user_folder("data") / "window"


def listening(host: str, wanted: int | None = None) -> socket.socket:
    """Return a socket that listens at the port wanted, or at the usual one, or at any free one.

    It holds the port from here on: two windows that start at once cannot both take it.

    Raises
    ------
    ParameterError
        When the port wanted is taken, or there is no such address on this computer.
    """
    for port in (wanted,) if wanted is not None else (PORT, 0):
        try:
            return socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET)
        except OSError as error:
            reason = (error.strerror or str(error)).partition(" (while")[0]
    raise df.ParameterError(
        f"cannot listen at {shorten(host)}, port {wanted or 'any'}: {reason.lower()}; choose another --host or --port"
    )


def serve(options: Options) -> None:
    """Start the server and show the window; returns when it is stopped."""
    folder = options.folder or data_folder()
    try:
        _make(folder)
        secret, cookie_secret = kept_secret(folder / "secret"), kept_secret(folder / "cookie-secret")
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise df.ParameterError(
            f"the window cannot write to the folder '{shorten(str(folder))}': {reason}; choose another --folder"
        ) from None
    # read by NiceGUI when it is imported, which is why that waits until here
    os.environ["NICEGUI_STORAGE_PATH"] = str(folder / "sessions")
    with contextlib.suppress(
        ImportError
    ):  # xarray and pint import it: two threads that do so at once meet it half done
        importlib.import_module("dask.base")
    import uvicorn
    from fastapi import FastAPI
    from fastapi.middleware.gzip import GZipMiddleware
    from nicegui import ui

    from dforce.gui.window import classroom, pages

    # a page must be answered while a thread compiles or prepares a run in Python
    sys.setswitchinterval(SWITCH)
    gc.set_threshold(*THRESHOLDS)
    held = listening(options.host, options.port)
    port = int(held.getsockname()[1])
    address = f"http://{_named(options.host)}:{port}/?{KEY}={secret}"
    alone = options.host in (OWN, "localhost", "::1")
    hosts = own_hosts(port) if alone else frozenset[str]()
    document = None if options.case is None else Document.of(options.case)
    files.guests_only = not alone
    code = "" if alone else classroom.new_code()
    short = f"{_named(options.host)}:{port}/{code}"
    guests = None if alone else classroom.Classroom(f"http://{short}", SHARED)
    file = options.file if alone else None
    pages.register(folder, document, ALONE if alone else SHARED, options.over, guests, file)
    app = FastAPI(openapi_url=None)
    app.add_middleware(Guard, secret=secret, cookie=f"dforce-{port}", hosts=hosts, code=code)
    ui.run_with(
        app,
        title="dForce",
        language="en-US",
        dark=None,
        reconnect_timeout=RECONNECT,
        storage_secret=cookie_secret,
        show_welcome_message=False,
        gzip_middleware_factory=None if alone else GZipMiddleware,
        favicon=str(Path(__file__).parent / "icon.svg"),
        tailwind=False,
        session_middleware_kwargs={
            "max_age": 10 * 365 * 86400,
            "same_site": "lax",
            "session_cookie": f"dforce-session-{port}",
        },
    )
    # numbers hardly shrink, and packing them takes time and memory for each page
    server = uvicorn.Server(uvicorn.Config(app, log_level="warning", ws="wsproto", ws_per_message_deflate=False))
    joining = "" if alone else f"A class joins at {short}. Page of who is there: button Class."
    threading.Thread(
        target=_announce, args=(server, address, options.show, folder / "browser", joining), daemon=True
    ).start()
    server.run(sockets=[held])


def own_hosts(port: int) -> frozenset[str]:
    """Return the values of the header Host under which a browser on this computer asks; it leaves out port 80."""
    names = (OWN, "localhost", "[::1]")
    return frozenset(f"{name}:{port}" for name in names) | frozenset(names if port == 80 else ())


def _make(folder: Path) -> None:
    """Make the folder with its own folders, which nobody but its owner may read."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    for name in ("sessions", "results"):
        (folder / name).mkdir(mode=0o700, exist_ok=True)


def _named(host: str) -> str:
    """Return the address of this computer for others: a number, because names need not be known on a network."""
    if host in EVERYWHERE:
        host = own_address(host)
    return f"[{host}]" if ":" in host else host


def own_address(host: str) -> str:
    """Return the address of this computer on its network; its name where it is on none."""
    family, far = EVERYWHERE[host]
    with socket.socket(family, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((far, 9))  # sends nothing: it only asks which way something would go
            return str(probe.getsockname()[0])
        except OSError:
            return socket.gethostname()


def _announce(server: uvicorn.Server, address: str, show: str, profile: Path, joining: str = "") -> None:
    """Print the address and show the window, once the server answers there."""
    while not server.started:
        time.sleep(0.02)
    print("\n".join([f"dForce is ready at {address}", *[joining] * bool(joining), "Stop it with Ctrl-C."]), flush=True)
    if show == "window" and open_window(address, profile):
        return
    if show != "no":
        webbrowser.open(address)


def find_browser() -> str | None:
    """Return the program of a browser of Chromium's family, None where none is found."""
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    return found or next((place for place in map(os.path.expanduser, PLACES) if Path(place).exists()), None)


def open_window(address: str, profile: Path) -> bool:
    """Open an application window, a browser without bars and with its own profile; False where none starts."""
    found = find_browser()
    if found is None:
        print("No Chromium, Chrome or Edge was found, so the window opens in the browser.", file=sys.stderr)
        return False
    started = subprocess.Popen(
        [found, f"--app={address}", f"--user-data-dir={profile}", "--window-size=1366,800", "--no-first-run"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        failed = started.wait(timeout=STARTS_WITHIN) != 0  # one that hands over to a running one ends with 0
    except subprocess.TimeoutExpired:
        return True
    if failed:
        print(f"{Path(found).name} could not be started, so the window opens in the browser.", file=sys.stderr)
    return not failed
