"""The window's server in a process of its own, as a user starts it."""

from __future__ import annotations

import contextlib
import queue
import re
import subprocess
import threading
import time
import urllib.parse
from collections.abc import Iterator
from pathlib import Path

from dforce.core import child

READY = re.compile(r"dForce is ready at (\S+)")
STARTING = 120.0  # s for a server to start, on a busy machine


class Server:
    """`dforce gui` on a free port, with a folder of its own.

    Parameters
    ----------
    folder
        Where it keeps what is typed and computed.
    arguments
        More of the command line.

    Raises
    ------
    RuntimeError
        When it ends before it is ready, with what it said.
    """

    def __init__(self, folder: Path, *arguments: str) -> None:
        self.folder, self.arguments = folder, arguments
        self.port = 0
        self.start()

    def start(self) -> None:
        """Start it, after the first time at the same port."""
        command = child.command("-m", "dforce", "gui", "--no-browser", "--folder", str(self.folder), *self.arguments)
        if self.port:
            command += ["--port", str(self.port)]
        # NiceGUI waits for a simulated browser where it finds that pytest runs
        environment = {key: value for key, value in child.environment().items() if "PYTEST" not in key}
        self.process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=environment,
        )
        self.said: list[str] = []
        lines: queue.Queue[str | None] = queue.Queue()
        self.listener = threading.Thread(target=self._listen, args=(lines,), daemon=True)
        self.listener.start()
        until = time.monotonic() + STARTING
        with contextlib.suppress(queue.Empty):
            while (line := lines.get(timeout=max(0.0, until - time.monotonic()))) is not None:
                if ready := READY.search(line):
                    self.address = ready[1]
                    self.port = int(urllib.parse.urlsplit(self.address).port or 0)
                    return
        self.kill()
        raise RuntimeError("the server did not start: " + "".join(self.said))

    def _listen(self, lines: queue.Queue[str | None]) -> None:
        assert self.process.stdout is not None
        with self.process.stdout as stream:
            for line in stream:
                self.said.append(line)
                lines.put(line)
        lines.put(None)

    @property
    def home(self) -> str:
        """The address without its secret."""
        return f"http://127.0.0.1:{self.port}"

    @property
    def memory(self) -> float | None:
        """The memory that it takes (MB), None where the system does not tell."""
        status = Path(f"/proc/{self.process.pid}/status")
        found = re.search(r"VmRSS:\s+(\d+)", status.read_text()) if status.exists() else None
        return int(found[1]) / 1024 if found else None

    def kill(self) -> None:
        """End it at once, as a crash or a lost battery does."""
        self.process.kill()
        self.process.wait()
        self.listener.join()

    def stop(self) -> None:
        """End it as Ctrl-C does."""
        self.process.terminate()
        try:
            self.process.wait(timeout=20)
            self.listener.join()
        except subprocess.TimeoutExpired:
            self.kill()


@contextlib.contextmanager
def served(folder: Path, *arguments: str) -> Iterator[Server]:
    """Give a server, and end it."""
    server = Server(folder, *arguments)
    try:
        yield server
    finally:
        server.stop()
