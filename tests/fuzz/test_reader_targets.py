"""Fuzzing of the readers of motion files: one error type, consistent results.

BUNRAKU_FUZZ_RUNS sets the number of inputs of each reader.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings

from tests.fuzz.corruption import hostile_inputs
from tests.fuzz.guided import REPOSITORY, RUNS, TIMEOUT_S, run_guided
from tests.fuzz.reader_targets import DICTIONARY, TARGETS, fbx, load_fbx_seeds, load_seeds

EXAMPLES = 500
FBX_INPUTS_PER_PROCESS = 2_500
"""Each keeps its scene in memory for ever."""
FBX_TIMEOUT_S = 300.0
NAMES = [target.__name__ for target in TARGETS]
SEEDS = load_seeds()


@pytest.mark.parametrize("seed", SEEDS, ids=[f"{NAMES[target]}-{number}" for number, (target, _) in enumerate(SEEDS)])
def test_seeds_are_accepted(seed: tuple[int, bytes]) -> None:
    assert TARGETS[seed[0]](seed[1])


def test_fbx_seeds_are_accepted() -> None:
    assert all(fbx(seed) for seed in load_fbx_seeds())


@pytest.mark.parametrize("number", range(len(TARGETS)), ids=NAMES)
def test_random_input_is_accepted_or_rejected_as_declared(number: int, tally: Callable[[str], None]) -> None:
    counts = [0, 0]

    @settings(max_examples=EXAMPLES)
    @given(hostile_inputs([data for target, data in SEEDS if target == number], max_bytes=1 << 20))
    def check(data: bytes) -> None:
        counts[TARGETS[number](data)] += 1

    check()
    assert counts[0] > 0
    tally(f"Hypothesis, {NAMES[number]}: {sum(counts)} inputs, {counts[1]} accepted, {counts[0]} rejected")


@pytest.mark.timeout(TIMEOUT_S)
@pytest.mark.parametrize("number", range(len(TARGETS)), ids=NAMES)
def test_coverage_guided_input_is_accepted_or_rejected_as_declared(
    number: int, tmp_path: Path, tally: Callable[[str], None]
) -> None:
    rejected, accepted = run_guided(NAMES[number], number, len(TARGETS), DICTIONARY, tmp_path)
    tally(f"atheris, {NAMES[number]}: {rejected + accepted} inputs, {accepted} accepted, {rejected} rejected")


@pytest.mark.timeout(FBX_TIMEOUT_S * (1 + RUNS // FBX_INPUTS_PER_PROCESS))
def test_broken_fbx_files_are_accepted_or_rejected_as_declared(tally: Callable[[str], None]) -> None:
    counts = [0, 0]
    for seed in range(max(RUNS // FBX_INPUTS_PER_PROCESS, 1)):
        result = subprocess.run(
            [sys.executable, "-m", "tests.fuzz.fbx", str(seed), str(min(RUNS, FBX_INPUTS_PER_PROCESS))],
            cwd=REPOSITORY,
            capture_output=True,
            text=True,
            timeout=FBX_TIMEOUT_S,
            check=False,
        )
        assert result.returncode == 0, f"seed {seed}: {result.returncode}\n{result.stderr[-4000:]}"
        for outcome, count in enumerate(result.stdout.split()):
            counts[outcome] += int(count)
    assert min(counts) > 0
    tally(f"random, fbx: {sum(counts)} inputs, {counts[1]} accepted, {counts[0]} rejected")
