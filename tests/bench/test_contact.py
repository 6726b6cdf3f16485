from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.bench import contact


def test_parts_are_chosen_by_name() -> None:
    assert contact.parse_arguments([]) == (list(contact.PARTS), 10_000)
    assert contact.parse_arguments(["--only", "feet", "--scenes", "7"]) == (["feet"], 7)


def test_unknown_part_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        contact.parse_arguments(["--only", "feet,tail"])
    assert "unknown part 'tail'" in capsys.readouterr().err


def test_last_line_has_the_figures_of_all_parts(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    parts = {"one": lambda shared, _: {"a": len(shared.name)}, "two": lambda _, scenes: {"b": scenes}}
    monkeypatch.setattr(contact, "PARTS", parts)
    monkeypatch.setattr("sys.argv", ["contact", "--only", "one,two"])
    monkeypatch.setenv("BUNRAKU_SHARED", str(tmp_path))
    contact.main()
    assert json.loads(capsys.readouterr().out.splitlines()[-1]) == {"a": len(tmp_path.name), "b": 10_000}
