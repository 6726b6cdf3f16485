from __future__ import annotations

import asyncio
import json
import os
import signal
import subprocess
import sys

import pytest
import typer
from rich.table import Table

from bunraku import terminal
from bunraku.client.server_problem import ServerProblem
from tests.time_limit import HANG_TIMEOUT_S


def test_print_plain_ignores_markup_and_width(capsys: pytest.CaptureFixture[str]) -> None:
    text = "[bold]a [name] in brackets[/bold] " + 60 * "long "
    terminal.print_plain(text)
    assert capsys.readouterr().out == f"{text}\n"


def test_statistics_are_printed_as_table_or_json(capsys: pytest.CaptureFixture[str]) -> None:
    statistics = {"first_pose_ms": None, "gaps": 0}
    terminal.print_statistics(statistics, as_json=False)
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert rows == [["first", "pose", "ms", "-"], ["gaps", "0"]]
    terminal.print_statistics(statistics, as_json=True)
    assert json.loads(capsys.readouterr().out) == statistics


HOSTILE = "\x1b]0;owned\x07\x9b2J\u202ename\n[red]forged[/] :smile: \ud800"
ESCAPED = r"\u001b]0;owned\u0007\u009b2J\u202ename\u000a[red]forged[/] :smile: \ud800"


def test_hostile_text_is_printed_as_escapes_in_lines_tables_and_errors(capsys: pytest.CaptureFixture[str]) -> None:
    table = Table("name [/]", box=None)
    table.add_row(HOSTILE)
    terminal.out.print(table, soft_wrap=True)
    terminal.print_plain(HOSTILE)
    terminal.print_statistics({"name": HOSTILE}, as_json=False)
    terminal.err.print(str(ServerProblem(404, {"title": HOSTILE, "detail": "none"})), soft_wrap=True)
    printed = capsys.readouterr()
    # tables wrap
    assert "".join(printed.out.split()).count("".join(ESCAPED.split())) == 3
    assert printed.err == f"{ESCAPED}: none\n"
    assert not {"\x1b", "\x07", "\x9b", "\u202e"} & set(printed.out + printed.err)


def test_json_output_of_hostile_text_is_valid_and_equal(capsys: pytest.CaptureFixture[str]) -> None:
    terminal.out.print_json(data={"name": HOSTILE, "items": ["人形 👍🏽"]})
    printed = capsys.readouterr().out
    assert json.loads(printed) == {"name": HOSTILE, "items": ["人形 👍🏽"]}
    assert "人形 👍🏽" in printed
    assert not {"\x1b", "\x07", "\x9b", "\u202e"} & set(printed)


def test_failed_request_prints_the_error_escaped(capsys: pytest.CaptureFixture[str]) -> None:
    async def fail() -> None:
        raise ServerProblem(422, {"title": "Bad", "detail": HOSTILE})

    with pytest.raises(typer.Exit):
        terminal.run_request(fail, "http://127.0.0.1:1")
    assert "\x1b" not in capsys.readouterr().err


def run_until_signalled(*sent: signal.Signals) -> int:
    """Run a process that never ends after it is stopped, send it signals one after the other, and return its status."""
    code = (
        "import asyncio\n"
        "from bunraku.terminal import call_when_stopped\n"
        "async def main():\n"
        "    call_when_stopped(lambda: print('stopped', flush=True))\n"
        "    print('ready', flush=True)\n"
        "    await asyncio.Event().wait()\n"
        "asyncio.run(main())\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    try:
        assert process.stdout is not None
        for number, expected in zip(sent, (b"ready\n", b"stopped\n"), strict=False):
            assert process.stdout.readline() == expected
            process.send_signal(number)
        return process.wait(HANG_TIMEOUT_S)
    finally:
        process.kill()
        process.communicate()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_second_signal_ends_a_process_that_was_asked_to_stop(number: signal.Signals) -> None:
    assert run_until_signalled(number, number) == -number


async def test_lines_of_the_input_are_passed_on(monkeypatch: pytest.MonkeyPatch) -> None:
    parts = [b"c\n a", b" b \nunfinished", b""]
    monkeypatch.setattr(os, "isatty", lambda _: False)
    monkeypatch.setattr(os, "read", lambda *_: parts.pop(0))
    lines: asyncio.Queue[str] = asyncio.Queue()
    terminal.call_at_input(lines.put_nowait)
    async with asyncio.timeout(HANG_TIMEOUT_S):
        assert [await lines.get(), await lines.get()] == ["c", "a b"]
