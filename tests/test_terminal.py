from __future__ import annotations

import json

import pytest

from bunraku import terminal


def test_words_are_printed_as_they_stand(capsys: pytest.CaptureFixture[str]) -> None:
    words = "[bold]a [name] of somebody's[/bold] " + 60 * "long "
    terminal.print_plain(words)
    assert capsys.readouterr().out == f"{words}\n"


def test_figures_are_printed_by_their_names_and_what_did_not_come_is_a_dash(capsys: pytest.CaptureFixture[str]) -> None:
    figures = {"first_pose_ms": None, "gaps": 0}
    terminal.print_statistics(figures, as_json=False)
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert rows == [["first", "pose", "ms", "-"], ["gaps", "0"]]
    terminal.print_statistics(figures, as_json=True)
    assert json.loads(capsys.readouterr().out) == figures
