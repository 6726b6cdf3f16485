from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import msgpack
import numpy as np
import pytest

from bunraku.codec.container import unpack_motion
from bunraku.codec.extension.track import ExtensionTrack
from bunraku.ingest.jobs.motion import encode_file, list_file_takes
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.motion.readers.takes import TakeList
from tests.motion.extended_source import extended_source, write_source_bvh
from tests.motion.readers.fbx_writer import write_fbx
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


@pytest.mark.parametrize("joint", ["Neck", "Head"])
def test_bone_that_is_too_long_is_rejected_with_a_hint(joint: str, tmp_path: Path) -> None:
    dance = extended_source(20)
    places = dance.rest_positions.copy()
    places[dance.names.index(joint) : dance.names.index("Head") + 1, 1] += 8.0
    source = tmp_path / "source"
    source.write_bytes(write_source_bvh(replace(dance, rest_positions=places)))
    rejected = encode_file("m1", source)
    assert isinstance(rejected, JobRejection)
    assert rejected.title == "Bone too long"
    assert rejected.hint


def test_source_with_clavicles_gets_an_extension_that_is_described(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(write_source_bvh(extended_source(60)))
    result = encode_file("m1", source)
    assert isinstance(result, JobResult)
    assert result.description["tracks"] == ["motion", "extension"]
    described = result.description["extension"]
    assert described["joints"] == ["vl5", "vl1", "vt10", "vc4", "l_sternoclavicular", "r_sternoclavicular"]
    assert described["fit"]["mean_mm"] < 1.5 < result.description["fit"]["mean_mm"]
    stored = unpack_motion("m1", result.packed)
    assert isinstance(stored.tracks[1], ExtensionTrack)
    assert stored.tracks[1].block_count == stored.first_track.block_count


@pytest.mark.parametrize("frames", [1, 20])
def test_single_pose_is_rejected_where_motion_is_required(frames: int, tmp_path: Path) -> None:
    header, _, values = make_bvh_clip(1 / 30).partition(b"Frames: 1")
    time, row = values.strip().split(b"\n")
    source = tmp_path / "source"
    source.write_bytes(b"%sFrames: %d\n%s\n%s\n" % (header, frames, time, b"\n".join([row] * frames)))
    rejected = encode_file("m1", source, must_move=True)
    assert isinstance(rejected, JobRejection)
    assert rejected.title == "Nothing moves"
    assert isinstance(encode_file("m1", source), JobResult)


def test_takes_are_listed(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(write_fbx(takes=("walk", "run", "jump")))
    assert list_file_takes(source, 2) == TakeList(["walk", "run"], 3)
    source.write_bytes(b"PK\x03\x04" + bytes(100))
    assert isinstance(list_file_takes(source, 2), JobRejection)


def test_jobs_compile_nothing_that_is_not_compiled_with_their_module() -> None:
    # a job runs in a sandbox, in which nothing compiled can be kept
    script = """
import sys
from pathlib import Path
from bunraku.ingest.jobs import motion
from bunraku.codec import _kernels
from tests.motion.hand_source import hand_source
from tests.motion.readers.faces import FaceGlb
from tests.motion.readers.sources import write_glb
import numpy as np
kernels = [each for name in _kernels.__all__ if hasattr(each := getattr(_kernels, name), "signatures")]
before = [list(kernel.signatures) for kernel in kernels]
face = FaceGlb(write_glb(hand_source(75)))
face.add_morphs({"jawOpen": np.linspace(0.0, 1.0, 75), "eyeBlinkLeft": np.linspace(1.0, 0.0, 75)}, 30.0)
path = Path(sys.argv[1])
path.write_bytes(face.pack())
assert motion.encode_file("m", path).description["tracks"] == ["motion", "extension", "extension", "extension"]
print([kernel.__name__ for kernel, known in zip(kernels, before) if kernel.signatures != known])
"""
    with TemporaryDirectory() as folder:
        command = [sys.executable, "-c", script, f"{folder}/acted.glb"]
        found = subprocess.run(command, capture_output=True, text=True, check=False)
    assert found.stdout.strip() == "[]", found.stderr
