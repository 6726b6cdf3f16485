from __future__ import annotations

from bunraku.messaging.heartbeat_observer import HeartbeatObserver


def test_unchanged_value_stops_after_the_timeout() -> None:
    observer = HeartbeatObserver(10.0)
    for second in range(0, 60, 5):
        observer.observe({"silent": 1, "living": second}, float(second))
        assert not observer.has_stopped("living")
        assert observer.has_stopped("silent") == (second > 10)
        assert observer.silence_s("silent") == second
    # any other value is a heartbeat, also a lower one
    observer.observe({"silent": 0}, 60.0)
    assert not observer.has_stopped("silent")
    assert not observer.is_known("living")


def test_silence_does_not_count_while_the_observer_was_blind() -> None:
    observer = HeartbeatObserver(10.0)
    for second in (0, 7, 20, 27):
        observer.observe({"a": 1}, float(second))
        assert not observer.has_stopped("a")
    observer.observe({"a": 1}, 34.0)
    assert observer.has_stopped("a")


def test_value_none_is_a_value() -> None:
    observer = HeartbeatObserver(1.0)
    observer.observe({"a": None}, 0.0)
    observer.observe({"a": None}, 0.7)
    observer.observe({"a": None}, 1.4)
    assert observer.has_stopped("a")
