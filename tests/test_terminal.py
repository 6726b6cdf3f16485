from __future__ import annotations

import json

import pytest

from bunraku import terminal


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
