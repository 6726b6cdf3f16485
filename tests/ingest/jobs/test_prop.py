from __future__ import annotations

import gzip
from pathlib import Path

from bunraku.ingest.jobs.prop import make_prop
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.motion.readers.gltf_file import parse_gltf_file
from bunraku.props.placing import Grip
from tests.props.samples import box_glb


def test_file_becomes_a_compressed_model_and_its_description(tmp_path: Path) -> None:
    path = tmp_path / "box"
    path.write_bytes(box_glb())
    result = make_prop("id", path, None, None)
    assert isinstance(result, JobResult)
    assert result.description == {
        "vertices": 24,
        "triangles": 12,
        "bytes": len(result.packed),
        "size": [0.05, 0.6, 0.05],
        "guessed": [],
    }
    assert len(parse_gltf_file(gzip.decompress(result.packed)).items("meshes")) == 1
    assert make_prop("id", path, None, None) == result
    longer = make_prop("id", path, 1.2, Grip.MIDDLE)
    assert isinstance(longer, JobResult)
    assert longer.description["size"] == [0.1, 1.2, 0.1]


def test_other_file_is_rejected_with_its_reason(tmp_path: Path) -> None:
    path = tmp_path / "text"
    path.write_bytes(b"text")
    assert make_prop("id", path, None, None) == JobRejection(
        "Not a glTF file", "its JSON part is broken", 1, None, "export the file again, as GLB"
    )
