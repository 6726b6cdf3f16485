from __future__ import annotations

from pathlib import Path

import msgpack
import numpy as np
import pytest

from bunraku.ingest.jobs.motion import encode_file
from bunraku.ingest.result import JobRejection, JobResult
from tests.servers import make_bvh_clip


def test_motion_is_encoded_and_described(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(make_bvh_clip(1.5))
    shares: list[float] = []
    result = encode_file("m1", source, on_progress=shares.append)
    assert isinstance(result, JobResult)
    assert result.description["blocks"] == 2
    # one report at the start, one per block and level
    assert shares == pytest.approx(np.linspace(0, 1, 1 + 2 * len(result.description["rates"])))
    assert [len(rate) for rate in msgpack.unpackb(result.packed)["tracks"][0]] == [2] * len(result.description["rates"])


def test_real_clips_are_encoded(shared: Path) -> None:
    for path in sorted((shared / "mocap" / "bvh").glob("mass_*.bvh")):
        result = encode_file("m1", path)
        assert isinstance(result, JobResult), result
        assert result.description["fit"]["mean_mm"] < 20


def test_invalid_file_is_rejected_with_a_hint(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(b"HIERARCHY\nROOT hips\n{\n")
    rejected = encode_file("m1", source)
    assert isinstance(rejected, JobRejection)
    assert rejected.line is not None
    assert rejected.hint
