from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette.crowd.policy import TRIM, CrowdPolicy, mean_target
from bunraku.marionette.crowd.pulls import CrowdPulls
from bunraku.marionette.crowd.summary import BIN_UNITS, SUMMARY_BYTES, UNITS, CrowdSummary
from bunraku.marionette.solver.vector import Vector
from bunraku.wire.errors import MalformedMessage

coordinates = st.floats(-0.57, 0.57, allow_subnormal=False)
points = st.tuples(coordinates, coordinates, coordinates)
members = st.lists(points, min_size=1, max_size=60)
BIN_WIDTH = BIN_UNITS / UNITS


def summarise(pulls: list[Vector], first_key: int = 0) -> CrowdSummary:
    crowd = CrowdPulls(0)
    for n, values in enumerate(pulls):
        crowd.pull((first_key + n) * 0x9E3779B97F4A7C15 % 2**64, values, 7)
    return crowd.summarise(7)


@given(st.lists(members, min_size=1, max_size=5), st.randoms())
def test_merge_does_not_depend_on_the_order_or_the_replicas(replicas: list[list[Vector]], random: Random) -> None:
    parts = [summarise(pulls, 100 * n) for n, pulls in enumerate(replicas)]
    merged = reduce(CrowdSummary.merge, parts, CrowdSummary())
    shuffled = parts[:]
    random.shuffle(shuffled)
    assert reduce(CrowdSummary.merge, shuffled, CrowdSummary()).pack() == merged.pack()
    assert merged.count == sum(map(len, replicas))
    at_one = CrowdPulls(0)
    for n, pulls in enumerate(replicas):
        for m, values in enumerate(pulls):
            at_one.pull((100 * n + m) * 0x9E3779B97F4A7C15 % 2**64, values, 7)
    assert at_one.summarise(7).pack() == merged.pack()


@given(members)
def test_packed_summary_has_one_size_and_is_the_same_again(pulls: list[Vector]) -> None:
    packed = summarise(pulls).pack()
    assert len(packed) == SUMMARY_BYTES == len(CrowdSummary().pack())
    assert CrowdSummary.unpack(packed).pack() == packed


@given(members)
def test_median_and_trimmed_mean_are_within_a_bin_of_the_exact_ones(pulls: list[Vector]) -> None:
    summary, exact = summarise(pulls), np.sort(np.array(pulls), axis=0)
    median = np.array(mean_target(summary, CrowdPolicy.MEDIAN))
    assert np.abs(median - np.median(exact, axis=0)).max() <= BIN_WIDTH + 1 / UNITS
    ranks = np.arange(len(pulls))
    low, high = TRIM * len(pulls), (1 - TRIM) * len(pulls)
    weights = np.clip(np.minimum(ranks + 1, high) - np.maximum(ranks, low), 0, None)
    trimmed = weights @ exact / weights.sum()
    assert np.abs(np.array(mean_target(summary, CrowdPolicy.TRIMMED_MEAN)) - trimmed).max() <= BIN_WIDTH + 1 / UNITS


@given(st.lists(points, min_size=8, max_size=60), st.data())
def test_saboteurs_move_a_trimmed_mean_by_at_most_their_share_of_the_spread(
    honest: list[Vector], data: st.DataObject
) -> None:
    saboteurs = data.draw(st.lists(points, min_size=1, max_size=len(honest) // 4))
    share = len(saboteurs) / (len(honest) + len(saboteurs))
    assert share <= TRIM
    before = np.array(mean_target(summarise(honest), CrowdPolicy.TRIMMED_MEAN))
    after = np.array(mean_target(summarise(honest + saboteurs), CrowdPolicy.TRIMMED_MEAN))
    spread = np.ptp(np.array(honest), axis=0)
    # both are within a bin of the exact values
    assert (np.abs(after - before) <= share / (1 - 2 * TRIM) * spread + 2 * (BIN_WIDTH + 1 / UNITS)).all()


@pytest.mark.parametrize("change", [lambda b: b[:-1], lambda b: b"\xff" * 4 + b[4:], lambda b: b[:4] + b"\x09" + b[5:]])
def test_malformed_summary_is_refused(change: Callable[[bytes], bytes]) -> None:
    with pytest.raises(MalformedMessage):
        CrowdSummary.unpack(change(summarise([(0.1, 0.2, 0.3)]).pack()))
