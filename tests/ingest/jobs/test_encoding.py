import pytest

from bunraku.ingest.jobs import encoding
from bunraku.ingest.jobs.encoding import describe_encoding, encode_motions
from tests.vectors.blocks import random_motion


def test_progress_is_the_share_of_all_motions() -> None:
    shares: list[float] = []
    motions = [random_motion(1.2, 30.0, seed) for seed in (1, 2)]
    encoded = list(encode_motions(motions, shares.append))
    assert shares == sorted(shares)
    assert max(shares) == pytest.approx(1.0)
    assert [describe_encoding(*pair)["frames"] for pair in zip(motions, encoded, strict=True)] == [36, 36]


def test_long_motions_are_encoded_in_one_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    motion = random_motion(1.2, 30.0, 1)
    (best,) = encode_motions([motion], lambda _: None)
    monkeypatch.setattr(encoding, "MAX_BEST_GRADE_FRAMES", 35)
    (live,) = encode_motions([motion], lambda _: None)
    assert describe_encoding(motion, live)["rates"][-1]["kbps"] > describe_encoding(motion, best)["rates"][-1]["kbps"]
