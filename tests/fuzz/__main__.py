"""Coverage-guided fuzzing in a separate process: `python -m tests.fuzz GROUP CORPUS COUNTS [options of libFuzzer]`.

GROUP is "contract", whose inputs select the target by their first byte, or the name of one target of `capture_targets`
or `reader_targets`. The Python code of the packages is instrumented. Compiled code cannot be, but its bounds are
checked if NUMBA_BOUNDSCHECK=1. The file COUNTS holds an int64 for each target and outcome (rejected, accepted). A
failure ends the process with its traceback on stdout and the bytes of the input on stderr.
"""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path

import atheris
import numpy as np

CONTRACT = [
    "bunraku.codec.audio",
    "bunraku.codec.coefficients",
    "bunraku.codec.extension.contact",
    "bunraku.codec.extension.props",
    "bunraku.codec.skeleton_description",
    "bunraku.codec.motion_decoder",
    "bunraku.codec.integer_coder",
    "bunraku.codec.leb128",
    "bunraku.codec.timing",
    "bunraku.codec.motion_track",
    "bunraku.codec.channel_weights",
    "bunraku.wire.messages",
    "tests.fuzz.targets",
]
CAPTURE = [
    "bunraku.capture.frame",
    "bunraku.capture.osc",
    "bunraku.capture.vmc_messages",
    "bunraku.capture.vmc",
    "bunraku.capture.mvn",
    "bunraku.capture.rokoko",
    "bunraku.capture.osc_mapping",
    "bunraku.capture.osc_capture",
    "tomllib",
    "bunraku.http.structured_body",
    "bunraku.session.live.performer_connection",
    "bunraku.session.live.sample_json",
    "bunraku.websocket.connection",
    "bunraku.websocket.frame",
    "bunraku.wire.live",
    "bunraku.wire.messages",
    "tests.fuzz.capture_targets",
    "tests.fuzz.performer_input",
]
READERS = [
    "bunraku.motion.readers.acclaim",
    "bunraku.motion.readers.archive",
    "bunraku.motion.readers.bvh",
    "bunraku.motion.readers.bvh_frames",
    "bunraku.motion.readers.bvh_hierarchy",
    "bunraku.motion.readers.gltf",
    "bunraku.motion.readers.gltf_file",
    "bunraku.motion.readers.motion_file",
    "bunraku.motion.readers.node_motion",
    "bunraku.props.material_reader",
    "bunraku.props.scene_reader",
    "tests.fuzz.reader_targets",
    "zipfile",
]
READER_GROUPS = ("bvh", "gltf", "acclaim", "archive", "prop")


def main() -> None:
    group, corpus, file, *options = sys.argv[1:]
    if group == "contract":
        import bunraku.codec._kernels

        modules, name = CONTRACT, "targets"
    elif group in READER_GROUPS:
        import bunraku.motion.readers._kernels  # noqa: F401

        modules, name = READERS, "reader_targets"
    else:
        modules, name = CAPTURE, "capture_targets"
    with atheris.instrument_imports(include=modules, enable_loader_override=False):
        module = import_module(f"tests.fuzz.{name}")
    targets, seeds = module.TARGETS, module.load_seeds()
    # libFuzzer ends the process without returning to Python, so counts are written to the file immediately
    counts = np.memmap(file, np.int64, "w+", shape=(len(targets), 2))
    only = None if group == "contract" else [target.__name__ for target in targets].index(group)
    for number, (target, data) in enumerate(seeds):
        if only is None or target == only:
            (Path(corpus) / f"{number:03}").write_bytes(data if only is not None else bytes([target]) + data)

    def run_target(data: bytes) -> None:
        if only is not None:
            counts[only, int(targets[only](data))] += 1
        elif data:
            number = data[0] % len(targets)
            counts[number, int(targets[number](data[1:]))] += 1

    atheris.Setup([sys.argv[0], corpus, *options], run_target)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
