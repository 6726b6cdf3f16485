"""Quick attacks against a real server process, and the measuring of the suite itself.

No absolute times are asserted. The bound on overlay gaps is generous, as other tests run beside this one; the full run
is `make verify-attack`.
"""

from __future__ import annotations

import asyncio
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.attack.inspect_storage import check_durability
from tests.attack.inspection import load_inspections
from tests.attack.lab import Lab, open_lab
from tests.attack.raw_socket import CLOSED, OPEN, RawSocket, frame
from tests.attack.registry import Attack, Report, Target, load_attacks
from tests.attack.resources import ResourceMeter, Resources, find_service_processes
from tests.attack.result import AttackResult
from tests.attack.server import run_attacked_server

SECONDS = 1.0
WINDOW_S = 0.3
VIEWERS = 4
MAX_GAP_RATIO = 12.0
"""Overlay gaps during an attack relative to calm ones: several times the bound of a full run, a tenth of a failure."""
FIRST_ROW_OF_ANSWERS = 14
"""From this row on quick attacks are single requests, whose answers count; they need no process."""
QUICK_ATTACKS = [one for one in load_attacks().values() if one.is_quick]
LOADS = [one for one in QUICK_ATTACKS if one.row < FIRST_ROW_OF_ANSWERS]
REQUESTS = [one for one in QUICK_ATTACKS if one.row >= FIRST_ROW_OF_ANSWERS]


@pytest.fixture(scope="module")
def lab() -> Iterator[Lab]:
    with open_lab(viewers=VIEWERS, window_s=WINDOW_S) as opened:
        yield opened


@pytest.mark.parametrize("attack", REQUESTS, ids=lambda one: one.name.replace(" ", "-"))
async def test_server_answers_as_specified(lab: Lab, attack: Attack) -> None:
    report, server = Report(), lab.server
    assert server is not None
    logged = server.logged_bytes()
    await attack.function(lab.make_target(SECONDS), report)
    assert not report.violations, "\n".join(report.violations)
    assert not server.tracebacks_since(logged)


@pytest.mark.timeout(300)
@pytest.mark.parametrize("attack", LOADS, ids=lambda one: one.name.replace(" ", "-"))
def test_server_holds_against(lab: Lab, attack: Attack) -> None:
    result = lab.run(attack, SECONDS, MAX_GAP_RATIO, attempts=2)
    assert result.held, "\n".join(result.violations)


def test_every_row_of_the_table_has_an_attack() -> None:
    rows = {one.row for one in load_attacks().values()} | {one.row for one in load_inspections().values()}
    assert rows == set(range(1, 20))


def test_gap_growth_and_drops_are_violations() -> None:
    result = AttackResult("x", 1, "calm")
    result.judge_gap(40.0, {"p99": 50.0, "max": 60.0, "dropped": 0}, 1.3)
    assert result.held
    result.judge_gap(40.0, {"p99": 53.0, "max": 60.0, "dropped": 0}, 1.3)
    assert result.is_only_slow
    dropped = AttackResult("x", 1, "calm")
    dropped.judge_gap(40.0, {"p99": 40.0, "max": 60.0, "dropped": 2}, 1.3)
    assert not dropped.is_only_slow
    assert dropped.violations == ["2 calm viewers were disconnected"]


def test_memory_and_descriptors_left_are_violations() -> None:
    result = AttackResult("x", 1, "calm")
    result.set_resources(Resources(100.0, 200.0, 30), Resources(149.0, 900.0, 400), Resources(120.0, 200.0, 40))
    result.judge_resources(50.0)
    assert result.held
    result.set_resources(Resources(100.0, 200.0, 30), Resources(151.0, 900.0, 400), Resources(120.0, 200.0, 80))
    result.judge_resources(50.0)
    assert result.violations == ["RSS grew by 51 MB, at most 50 MB are permitted", "50 descriptors are still open"]


def test_processor_shares_are_reported() -> None:
    result = AttackResult("x", 1, "calm")
    result.set_processor_shares(Resources(1.0, 1.0, 1, 2.0, 1.0), Resources(1.0, 1.0, 1, 3.0, 3.0), 4.0)
    assert (result.cpu_share, result.wait_share) == (0.25, 0.5)
    assert "loop runs 25% waits 50%" in result.format_row()


def test_order_of_system_calls_is_checked() -> None:
    calls = [
        '1 fsync(9</d/library/.tmp1>) = 0',
        '1 rename("/d/library/.tmp1", "/d/library/m.bin") = 0',
        '1 fsync(9</d/library>) = 0',
        '1 fdatasync(8</d/catalogue.sqlite-wal>) = 0',
    ]  # fmt: skip
    result = AttackResult("x", 9, "durable")
    check_durability(result, calls, "/d/library/m.bin")
    assert result.held
    for missing, expected in ((0, "the object is renamed without"), (2, "the row is stored without"), (3, "no sync")):
        result = AttackResult("x", 9, "durable")
        check_durability(result, calls[:missing] + calls[missing + 1 :], "/d/library/m.bin")
        assert any(one.startswith(expected) for one in result.violations), (missing, result.violations)


def test_tracebacks_in_the_log_are_counted(tmp_path: Path) -> None:
    with run_attacked_server(tmp_path) as server:
        offset = server.logged_bytes()
        with server.log.open("a") as log:
            log.write('{"exception": "Traceback (most recent call last):\\n  File \\"a\\"\\nValueError: wrong"}\n')
        assert server.tracebacks_since(offset) == ['ValueError: wrong"}']
        assert server.tracebacks_since(server.logged_bytes()) == []
        measured = server.meter.measure()
        assert measured.rss_mb > 10.0
        assert measured.cpu_s > 0.0
    assert server.process.poll() is not None


@pytest.mark.parametrize(("address", "is_found"), [("0.0.0.0", True), ("127.0.0.1", False)])
def test_services_of_a_stack_are_found_by_their_command(address: str, is_found: bool) -> None:
    code = "print(flush=True); input()"
    command = [sys.executable, "-c", code, "/usr/bin/bunraku", "up", "--host", address, "--service", "ik"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        # a process that has just been started may not have its command yet
        assert process.stdout is not None
        process.stdout.readline()
        assert (process.pid in find_service_processes()) == is_found
        assert ResourceMeter(lambda: [process.pid]).measure().descriptors >= 3
        process.communicate(b"\n")


class OneReply:
    """Server that answers the first connection with fixed bytes, after the first received ones."""

    def __init__(self, reply: bytes, *, close: bool) -> None:
        self._reply, self._close = reply, close
        self._listening = socket.create_server(("127.0.0.1", 0))
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._serve)

    def __enter__(self) -> Target:
        self._thread.start()
        return Target("127.0.0.1", self._listening.getsockname()[1], "s", "m", {}, 1.0)

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        self._listening.close()

    def _serve(self) -> None:
        connection, _ = self._listening.accept()
        with connection:
            connection.recv(65_536)
            connection.sendall(self._reply)
            if not self._close:
                self._ended.wait(60)


@pytest.mark.parametrize(
    ("reply", "close", "reaction"),
    [
        (b"HTTP/1.1 400 Bad Request\r\nContent-Length: 2\r\n\r\nno", False, "400"),
        (b"HTTP/1.1 100 Continue\r\n\r\nHTTP/1.1 413 Too Large\r\n\r\n", False, "413"),
        (b"", True, CLOSED),
        (b"HTTP/1.1 200", False, OPEN),
    ],
)
async def test_reaction_of_the_server_is_described(reply: bytes, close: bool, reaction: str) -> None:
    with OneReply(reply, close=close) as target:
        opened = await RawSocket.connect(target)
        await opened.send(b"x")
        assert await opened.describe_reaction(0.5 if reaction == OPEN else 20.0) == reaction
        opened.close()


async def test_close_code_is_found_behind_messages() -> None:
    with OneReply(b"\x82\x02\x01\x02" + b"\x82\x7e\0\x80" + bytes(128) + b"\x88\x02\x03\xf0", close=False) as target:
        opened = await RawSocket.connect(target)
        await opened.send(frame(9))
        assert await opened.read_close_code(20.0) == 1008
        assert [len(one) for one in opened.messages] == [2, 128]
        opened.close()


async def test_reset_is_noticed_without_reading() -> None:
    with OneReply(b"", close=True) as target:
        opened = await RawSocket.connect(target)
        await opened.send(b"x")
        async with asyncio.timeout(20):
            while not await opened.is_aborted():
                pass
        opened.close()
