from __future__ import annotations

import importlib.util

import pytest

from examples.robot.measurement import Measurement
from tests.bench import contact_robot


def test_figures_have_limits_and_falls() -> None:
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    figures = contact_robot.measure_robot(2.0)
    assert figures["robot_limits_broken"] == 0
    assert figures["robot_falls"] >= 0
    assert 0 < figures["robot_seconds"] <= 4


def test_all_kinds_of_broken_limits_count(monkeypatch: pytest.MonkeyPatch) -> None:
    measurement = Measurement()
    measurement.joint_limits_broken, measurement.torque_limits_broken, measurement.unstable = 1, 2, 4
    measurement.falls = 8

    async def run_demo(*_: object) -> dict[str, object]:
        return measurement.summary()

    monkeypatch.setattr(contact_robot, "run_demo", run_demo)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: name)
    figures = contact_robot.measure_robot()
    assert (figures["robot_limits_broken"], figures["robot_falls"]) == (7, 8)


def test_part_is_skipped_without_mujoco(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    assert contact_robot.measure_robot() == {}
    assert "MuJoCo is not installed" in capsys.readouterr().out
