from __future__ import annotations

from tests.bench.extension_rates import measure_face_kbps, measure_fingers_kbps


def test_fingers_and_face_take_less_than_their_bitrates() -> None:
    assert 0.2 < measure_fingers_kbps() <= 1.0
    assert 0.2 < measure_face_kbps() <= 0.6
