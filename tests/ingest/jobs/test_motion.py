from __future__ import annotations

from pathlib import Path

import msgpack
import numpy as np
import pytest

from bunraku.ingest.jobs.motion import encode_file
from bunraku.ingest.result import JobRejection, JobResult
from tests.servers import make_bvh_clip


def test_a_motion_is_made_and_described(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(make_bvh_clip(1.5))
    shares: list[float] = []
    made = encode_file("m1", source, shares.append)
    assert isinstance(made, JobResult)
    assert made.description["blocks"] == 2
    # the start, and two blocks at each rate
    assert shares == pytest.approx(np.linspace(0, 1, 1 + 2 * len(made.description["rates"])))
    assert [len(rate) for rate in msgpack.unpackb(made.packed)["tracks"][0]] == [2] * len(made.description["rates"])


def test_real_clips_become_motions(shared: Path) -> None:
    for path in sorted((shared / "mocap" / "bvh").glob("mass_*.bvh")):
        made = encode_file("m1", path)
        assert isinstance(made, JobResult), made
        assert made.description["fit"]["mean_mm"] < 20


def test_bad_files_are_refused_with_a_hint(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(b"HIERARCHY\nROOT hips\n{\n")
    refused = encode_file("m1", source)
    assert isinstance(refused, JobRejection)
    assert refused.line is not None
    assert refused.hint
