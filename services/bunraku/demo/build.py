"""Creation of the demo's files, `make demo-data`: original motion, music, camera and lights, encoded like an upload.

The files are part of the package, so that a first start encodes nothing. `tests/demo/test_build.py` checks that this
code still makes them.
"""

from __future__ import annotations

import hashlib
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

from bunraku.codec.container import unpack_motion
from bunraku.demo.bootstrap import DESCRIPTION_FILE, MOTION_FILE
from bunraku.demo.choreography import SCORE, TITLE, animate_dance
from bunraku.demo.music import render_music
from bunraku.demo.staging import camera_keyframes, light_keyframes
from bunraku.demo.wav import write_wav
from bunraku.ingest.jobs.audio import add_audio
from bunraku.ingest.jobs.motion import encode_file
from bunraku.ingest.jobs.scene import add_scene_of_body
from bunraku.ingest.result import require_result
from bunraku.motion.bvh_writer import write_bvh
from bunraku.storage.motion_id import derive_motion_id


def build_demo(folder: Path) -> tuple[bytes, dict[str, Any]]:
    """Return the demo's motion as an object of the motion store, and its id and description.

    `folder` receives the sources: dance, music and staging.
    """
    sources = {
        "dance.bvh": write_bvh(animate_dance()),
        "music.wav": write_wav(render_music()),
        "staging.json": json.dumps({"camera": camera_keyframes(SCORE), "lights": light_keyframes(SCORE)}).encode(),
    }
    for name, data in sources.items():
        (folder / name).write_bytes(data)
    motion_id = derive_motion_id(hashlib.sha256(b"".join(sources.values())).digest())
    result = require_result(encode_file(motion_id, folder / "dance.bvh"))
    description = {
        "name": TITLE,
        "filename": f"{TITLE}.bvh",
        "bytes": len(sources["dance.bvh"]),
        **result.description,
    }
    stored = unpack_motion(motion_id, result.packed)
    result = require_result(add_audio(motion_id, stored, folder / "music.wav"))
    audio = {"filename": f"{TITLE}.wav", "bytes": len(sources["music.wav"]), **result.description["audio"]}
    description |= result.description | {"audio": audio}
    stored = unpack_motion(motion_id, result.packed)
    result = require_result(add_scene_of_body(motion_id, stored, folder / "staging.json"))
    return result.packed, {"id": motion_id, "description": description | result.description}


def main() -> None:
    """Write the files into the package, or into the folder that is the first argument."""
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else MOTION_FILE.parent
    with tempfile.TemporaryDirectory(prefix="bunraku-demo-") as folder:
        packed, values = build_demo(Path(folder))
    (target / MOTION_FILE.name).write_bytes(packed)
    (target / DESCRIPTION_FILE.name).write_text(json.dumps(values, indent=1, ensure_ascii=False, sort_keys=True) + "\n")
    sys.stdout.write(f"{MOTION_FILE.name}: {len(packed):,} bytes\n")


if __name__ == "__main__":
    main()
