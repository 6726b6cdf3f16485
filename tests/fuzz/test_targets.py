"""Fuzzing with damaged, truncated and hostile bytes: one error type per package, bounded results, no other error."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.runtime.compile_cache import compile_cache_folder
from bunraku.wire.messages import Description
from tests.fuzz.corruption import hostile_inputs
from tests.fuzz.targets import TARGETS, TRACK_DESCRIPTIONS, load_seeds

REPOSITORY = Path(__file__).resolve().parents[2]
EXAMPLES = 1_000
RUNS = 3_000

SEEDS = load_seeds()


def golden_inputs(number: int) -> st.SearchStrategy[bytes]:
    """Return a strategy of inputs for a target: random bytes and corrupted golden bytes."""
    return hostile_inputs([data for target, data in SEEDS if target == number])


VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(1 << 63), (1 << 64) - 1),
    st.integers(0, 2000),
    st.floats(),
    st.floats(0, 1e-300),
    st.text(max_size=9),
    st.binary(max_size=9),
    st.lists(st.floats(), max_size=3),
)
HOSTILE_DESCRIPTIONS = st.builds(
    lambda track, changes: Description("motion", [track | changes]).pack(),
    st.sampled_from(TRACK_DESCRIPTIONS),
    st.dictionaries(st.sampled_from(sorted(TRACK_DESCRIPTIONS[0])), VALUES, max_size=3),
)


@pytest.mark.parametrize(
    ("number", "inputs"),
    [
        (0, golden_inputs(0)),
        (1, golden_inputs(1)),
        (2, golden_inputs(2)),
        (2, HOSTILE_DESCRIPTIONS),
        (3, golden_inputs(3)),
        (5, golden_inputs(5)),
        (6, golden_inputs(6)),
    ],
    ids=["blocks", "dancers", "messages", "descriptions", "audio", "contacts", "props"],
)
def test_random_input_is_accepted_or_rejected_as_declared(
    number: int, inputs: st.SearchStrategy[bytes], tally: Callable[[str], None], request: pytest.FixtureRequest
) -> None:
    counts = [0, 0]

    @settings(max_examples=EXAMPLES)
    @given(inputs)
    def check(data: bytes) -> None:
        counts[TARGETS[number](data)] += 1

    check()
    assert min(counts) > 0
    tally(f"Hypothesis, {request.node.callspec.id}: {sum(counts)} inputs, {counts[1]} accepted, {counts[0]} rejected")


@pytest.fixture
def checked_kernels(pytestconfig: pytest.Config, monkeypatch: pytest.MonkeyPatch) -> str:
    """Folder for kernels compiled with bounds checks, reused by later runs with the same sources."""
    assert pytestconfig.cache is not None
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(pytestconfig.cache.mkdir("boundscheck")))
    folder = compile_cache_folder("codec")
    assert folder is not None
    return folder


@pytest.mark.timeout(600)
def test_coverage_guided_input_is_accepted_or_rejected_as_declared(
    tmp_path: Path, tally: Callable[[str], None], checked_kernels: str
) -> None:
    if find_spec("atheris") is None:
        reason = "atheris is not installed: it has wheels for CPython 3.11 to 3.14 on Linux, x86-64"
        pytest.fail(reason) if os.environ.get("CI") else pytest.skip(reason)
    corpus, file = tmp_path / "corpus", tmp_path / "counts"
    corpus.mkdir()
    # the timeout of 60 s per input detects a hang; the cost of a block is bounded by its sizes, in the targets
    options = [f"-runs={RUNS}", "-timeout=60", "-rss_limit_mb=2048", f"-artifact_prefix={tmp_path}/"]
    result = subprocess.run(
        [sys.executable, "-m", "tests.fuzz", "contract", corpus, file, *options],
        cwd=REPOSITORY,
        env=os.environ | {"NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": checked_kernels},
        capture_output=True,
        text=True,
        timeout=580,
        check=False,
    )
    assert result.returncode == 0, result.stdout[-4000:] + result.stderr[-2000:]
    counts = np.fromfile(file, np.int64).reshape(len(TARGETS), 2)
    assert counts.min() > 0
    for target, (rejected, accepted) in zip(TARGETS, counts, strict=True):
        tally(f"atheris, {target.__name__}s: {rejected + accepted} inputs, {accepted} accepted, {rejected} rejected")
