"""Coverage-guided fuzzing of one target, in a process of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
RUNS = int(os.environ.get("BUNRAKU_FUZZ_RUNS", "10000"))
"""Inputs of each target."""
MAX_INPUT_BYTES = 16_384
MAX_MEMORY_MB = 1_024
MIN_INPUTS_PER_S = 50
"""Rate below which a run counts as hanging."""
TIMEOUT_S = 120 + RUNS // MIN_INPUTS_PER_S


def run_guided(name: str, number: int, count: int, words: Sequence[str], folder: Path) -> tuple[int, int]:
    """Run the target `name`, the `number`th of `count`, with `RUNS` inputs; return how many were rejected and accepted.

    The inputs are made of the target's seeds and of `words`. Skips the test without atheris, and fails it in CI.
    """
    if find_spec("atheris") is None:
        reason = "atheris is not installed: it has wheels for CPython 3.11 to 3.14 on Linux, x86-64"
        pytest.fail(reason) if os.environ.get("CI") else pytest.skip(reason)
    corpus, file = folder / "corpus", folder / "counts"
    corpus.mkdir()
    dictionary = folder / "words"
    dictionary.write_text("".join(f"{json.dumps(word)}\n" for word in words), encoding="ascii")
    options = [
        f"-dict={dictionary}",
        f"-runs={RUNS}",
        f"-max_len={MAX_INPUT_BYTES}",
        "-timeout=60",
        f"-rss_limit_mb={MAX_MEMORY_MB}",
        f"-artifact_prefix={folder}/",
    ]
    result = subprocess.run(
        [sys.executable, "-m", "tests.fuzz", name, corpus, file, *options],
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S - 20,
        check=False,
    )
    assert result.returncode == 0, result.stdout[-4000:] + result.stderr[-2000:]
    rejected, accepted = np.fromfile(file, np.int64).reshape(count, 2)[number].tolist()
    assert rejected + accepted >= RUNS
    assert min(rejected, accepted) > 0
    return rejected, accepted
