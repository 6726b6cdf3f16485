"""Fuzzing of the readers of live capture and of the input socket of performers: one error type, bounded results.

BUNRAKU_FUZZ_RUNS sets the number of coverage-guided inputs of each target.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import reduce
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.fuzz.capture_targets import DICTIONARY, TARGETS, load_seeds
from tests.fuzz.corruption import hostile_inputs
from tests.fuzz.datagram_sequence import LENGTH, join_datagrams
from tests.fuzz.guided import TIMEOUT_S, run_guided

EXAMPLES = 500
NAMES = [target.__name__ for target in TARGETS]
SEEDS = load_seeds()


@pytest.mark.parametrize("number", range(len(TARGETS)), ids=NAMES)
def test_random_input_is_accepted_or_rejected_as_declared(number: int, tally: Callable[[str], None]) -> None:
    counts = [0, 0]

    @settings(max_examples=EXAMPLES)
    @given(hostile_inputs([data for target, data in SEEDS if target == number]))
    def check(data: bytes) -> None:
        counts[TARGETS[number](data)] += 1

    check()
    assert min(counts) > 0
    tally(f"Hypothesis, {NAMES[number]}: {sum(counts)} inputs, {counts[1]} accepted, {counts[0]} rejected")


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-(10**400), 10**400) | st.floats() | st.text(max_size=9),
    lambda values: st.lists(values, max_size=3) | st.dictionaries(st.text(max_size=9), values, max_size=3),
    max_leaves=6,
)
CHANGES = st.lists(st.tuples(st.lists(st.integers(0, 9), min_size=1, max_size=8), VALUES), max_size=2)


def change_document(document: Any, path: list[int], value: Any) -> Any:
    """Return a JSON document with the value at `path`, the numbers of its members, replaced."""
    if not path or not isinstance(document, dict | list) or not document:
        return value
    keys = list(document) if isinstance(document, dict) else list(range(len(document)))
    changed: Any = document.copy()
    key = keys[path[0] % len(keys)]
    changed[key] = change_document(document[key], path[1:], value)
    return changed


SCENE = json.loads(next(data for target, data in SEEDS if target == NAMES.index("rokoko"))[LENGTH.size :])
SCENES = st.builds(
    lambda changes: reduce(lambda document, change: change_document(document, *change), changes, SCENE), CHANGES
)
ENTRIES = st.fixed_dictionaries(
    {
        "address": st.sampled_from(["/{joint}/r", "/{joint}/q", "/p", "/face/{joint}", "/t", "/end", "end"]),
        "kind": st.sampled_from(["rotation", "position", "blendshape", "time", "frame_end"]),
    },
    optional={
        "joint": st.sampled_from(["Hips", "l_knee", "ROOT", "tail"]),
        "names": st.dictionaries(st.sampled_from(["a", "Spine"]), st.sampled_from(["Head", "r_wrist", "tail"])),
        "order": st.sampled_from(["xyz", "zxy", "xyzw", "wxyz", "xxyz"]),
        "unit": st.sampled_from(["degrees", "radians", "m", "mm", "feet"]),
        "axes": st.sampled_from(["x y z", "-z x -y", "x x z"]),
        "first_argument": st.integers(-1, 3),
    },
)
MAPPINGS = st.builds(
    lambda space, entries: {"version": 1, "space": space, "map": entries},
    st.sampled_from(["world", "parent"]),
    st.lists(ENTRIES, min_size=1, max_size=2),
)


@pytest.mark.parametrize(("name", "documents"), [("rokoko", SCENES), ("osc_mapping", MAPPINGS)])
def test_hostile_documents_are_accepted_or_rejected_as_declared(
    name: str, documents: st.SearchStrategy[Any], tally: Callable[[str], None]
) -> None:
    counts = [0, 0]

    @settings(max_examples=EXAMPLES)
    @given(documents)
    def check(document: Any) -> None:
        data = json.dumps(document).encode()
        counts[TARGETS[NAMES.index(name)](join_datagrams(data) if name == "rokoko" else data)] += 1

    check()
    assert min(counts) > 0
    tally(f"Hypothesis, documents of {name}: {sum(counts)} inputs, {counts[1]} accepted, {counts[0]} rejected")


@pytest.mark.parametrize("seed", SEEDS, ids=[f"{NAMES[target]}-{number}" for number, (target, _) in enumerate(SEEDS)])
def test_seeds_are_accepted(seed: tuple[int, bytes]) -> None:
    assert TARGETS[seed[0]](seed[1])


@pytest.mark.timeout(TIMEOUT_S)
@pytest.mark.parametrize("number", range(len(TARGETS)), ids=NAMES)
def test_coverage_guided_input_is_accepted_or_rejected_as_declared(
    number: int, tmp_path: Path, tally: Callable[[str], None]
) -> None:
    rejected, accepted = run_guided(NAMES[number], number, len(TARGETS), DICTIONARY, tmp_path)
    tally(f"atheris, {NAMES[number]}: {rejected + accepted} inputs, {accepted} accepted, {rejected} rejected")
