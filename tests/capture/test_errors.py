from __future__ import annotations

from bunraku.capture.errors import UnreadableCapture


def test_message_has_problem_place_and_remedy() -> None:
    error = UnreadableCapture("Invalid rotation", "it is zero", field="Hips", line=3, hint="send another")
    assert str(error) == "Invalid rotation: line 3: Hips: it is zero (send another)"
    assert str(UnreadableCapture("No frames", "none came")) == "No frames: none came"
