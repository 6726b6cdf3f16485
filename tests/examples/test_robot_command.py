from __future__ import annotations

import sys

import pytest

from examples.robot import __main__ as command
from examples.robot.measurement import Measurement
from examples.robot.rehearsal import pull_hand, pull_leg


def test_demo_has_a_duration_and_a_server_has_none() -> None:
    assert command.parse_arguments(["--demo"]).seconds == 60
    assert command.parse_arguments(["http://127.0.0.1:8000"]).seconds == 86_400
    assert command.parse_arguments(["--demo", "--seconds", "3"]).seconds == 3


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ([], "give either the address of a server, or --demo"),
        (["http://127.0.0.1", "--demo"], "give either"),
        (["--demo", "--seconds", "nan"], "--seconds is above 0"),
        (["--demo", "--performer", "-1"], "--performer is 0 or above"),
    ],
)
def test_wrong_arguments_are_explained(
    arguments: list[str], reason: str, capsys: pytest.CaptureFixture[str]
) -> None:  # fmt: skip
    with pytest.raises(SystemExit):
        command.parse_arguments(arguments)
    assert reason in capsys.readouterr().err


def test_missing_mujoco_is_explained(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(SystemExit, match=r"requirements\.txt"):
        command.main(["--demo"])


def test_unreachable_server_is_explained() -> None:
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    with pytest.raises(SystemExit, match="cannot be reached"):
        command.main(["http://127.0.0.1:1"])


def test_figures_are_printed(capsys: pytest.CaptureFixture[str]) -> None:
    measurement = Measurement()
    measurement.falls = 3
    command.print_figures(measurement.summary())
    assert "falls           3" in capsys.readouterr().out


def test_two_people_pull_mirrored() -> None:
    for time_s in (0.0, 1.3, 5.5):
        left, right = pull_hand(1.0, time_s), pull_hand(-1.0, time_s)
        assert left == (-right[0], right[1], right[2])
        assert 0 <= pull_leg(time_s) <= 1
