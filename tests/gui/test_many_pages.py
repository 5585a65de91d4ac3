"""Pages of a server without a browser: what they leave behind, and what one of them costs the others."""

from __future__ import annotations

import asyncio
import itertools
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from served import Server, served

from dforce.gui.window.pages import CLOSED

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
from many_users import CASE, Person, person_at

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="what a process takes is read from /proc")

AFTERWARDS = 5.0  # s
VISITS, MOST = 40, 0.3  # MB a visit; a session and a page that stayed took 1 MB
PAGE = 4.0  # MB
TOWERS = [f"12 {unit}" for unit in ("nm**9**9**9**9", "nm^9^9^9", "9**9**9**9", "m/(9**9**9)", "m**(9**(9**9))")]


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    with served(tmp_path, CASE) as one:
        yield one


async def visits(server: Server, count: int) -> None:
    for number in range(count):
        async with person_at(server, number) as person:
            await person.ask(6.0 + 0.01 * number)
            await asyncio.sleep(0.1)


def memory_after_visits(server: Server) -> float:
    """Return the memory of a server (MB) after some visits, once their pages are given up."""
    asyncio.run(visits(server, VISITS))
    time.sleep(AFTERWARDS)
    assert server.memory is not None
    return server.memory


@pytest.mark.long
@pytest.mark.timeout(1800)
@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_visit_leaves_next_to_nothing_in_the_server(server: Server) -> None:
    memory_after_visits(server)  # its curves are computed; later visits show them again, which loads more
    # modules, the most pages at once, and states behind the curves fill memory in some rounds; a leak fills it in each round
    memory = [memory_after_visits(server) for _ in range(4)]
    assert min(after - before for before, after in itertools.pairwise(memory)) < VISITS * MOST


@pytest.mark.slow
def test_new_pages_are_in_the_memory_of_closed_pages(server: Server) -> None:
    async def come(count: int) -> None:
        for number in range(count):
            async with person_at(server, number):
                pass

    memory = []
    for _ in range(4):
        asyncio.run(come(CLOSED))
        time.sleep(AFTERWARDS)
        memory.append(server.memory or 0.0)
    assert memory[-1] < memory[0] + CLOSED * PAGE


@pytest.mark.slow
def test_a_page_whose_connection_was_cut_may_come_back_and_one_that_was_left_is_gone(server: Server) -> None:
    async def come_back(left: bool) -> None:
        person = Person(server, 0)
        await person.open()
        await (person.leave() if left else person.socket.disconnect())
        await asyncio.sleep(1.0)
        try:
            await person.connect()
        finally:
            await person.socket.disconnect()

    asyncio.run(come_back(left=False))
    with pytest.raises(RuntimeError, match="does not know"):
        asyncio.run(come_back(left=True))


def cpu_time(server: Server) -> float:
    """Return the processor time of a server (s)."""
    fields = Path(f"/proc/{server.process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@pytest.mark.slow
def test_a_tower_of_powers_in_a_field_keeps_no_other_page_waiting(server: Server) -> None:
    async def load(others: list[str]) -> float:
        async with person_at(server, 0) as person:
            before = cpu_time(server)
            for text in others:
                await person.type(text)
            async with person_at(server, 1):
                return cpu_time(server) - before

    asyncio.run(load([]))
    alone = asyncio.run(load([]))
    assert asyncio.run(load(TOWERS)) < alone + 1.0
