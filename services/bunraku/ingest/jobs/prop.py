"""Job that makes the model of a prop from a glTF file."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path

from bunraku.ingest.jobs.image_file import decode_image
from bunraku.ingest.result import JobRejection, JobResult, reject_file
from bunraku.motion.errors import UnreadableFile
from bunraku.props.model_file import write_model
from bunraku.props.placing import Grip
from bunraku.props.reader import read_prop


def make_prop(
    _prop_id: str,
    path: Path,
    length: float | None,
    grip: Grip | None,
    _on_progress: Callable[[float], None] = lambda _: None,
) -> JobResult | JobRejection:
    """Return the model of a file, compressed with gzip, and its part of the description."""
    try:
        model, guessed = read_prop(path.read_bytes(), decode_image, length, grip)
    except UnreadableFile as error:
        return reject_file(error)
    # without a time of compression: equal models have equal bytes
    packed = gzip.compress(write_model(model), mtime=0)
    description = {
        "vertices": len(model.positions),
        "triangles": len(model.triangles),
        "bytes": len(packed),
        "size": model.size,
        "guessed": guessed,
    }
    return JobResult(packed, description)
