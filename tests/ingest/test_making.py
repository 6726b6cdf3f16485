from __future__ import annotations

from pathlib import Path

import msgpack
import numpy as np
import pytest

from bunraku.ingest.making import make
from bunraku.ingest.results import Made, Refused
from tests.servers import clip


def test_a_motion_is_made_and_described(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(clip(1.5))
    shares: list[float] = []
    made = make("m1", source, shares.append)
    assert isinstance(made, Made)
    assert made.described["blocks"] == 2
    # the start, and two blocks at each rate
    assert shares == pytest.approx(np.linspace(0, 1, 1 + 2 * len(made.described["rates"])))
    assert [len(rate) for rate in msgpack.unpackb(made.packed)["tracks"][0]] == [2] * len(made.described["rates"])


def test_real_clips_become_motions(shared: Path) -> None:
    for path in sorted((shared / "mocap" / "bvh").glob("mass_*.bvh")):
        made = make("m1", path)
        assert isinstance(made, Made), made
        assert made.described["fit"]["mean_mm"] < 20


def test_bad_files_are_refused_with_a_hint(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(b"HIERARCHY\nROOT hips\n{\n")
    refused = make("m1", source)
    assert isinstance(refused, Refused)
    assert refused.line is not None
    assert refused.hint
