"""A narrow line from end to end: the real server, a headless viewer, and an emulated line with real TCP between."""

from __future__ import annotations

import asyncio
import os
from pathlib import Path

import pytest

from bunraku.backing.library import Library, pack
from bunraku.client import Figures, Viewer
from bunraku.codec import decode
from bunraku.codec.encode import encode_motion
from tests.bench.network import Link, missing, network
from tests.servers import running
from tests.vectors.blocks import wandering_motion


def test_a_dance_comes_soon_over_28_kbit_and_goes_on_where_it_was_after_a_cut(tmp_path: Path) -> None:
    if (reason := missing()) is not None:
        if os.environ.get("CI") and "/dev/net/tun" not in reason:
            pytest.fail(f"in CI lines must be emulated: {reason}")
        pytest.skip(reason)
    decode.warm()
    encoded = encode_motion(wandering_motion(20.0, 30.0, 5), ladder=(30.0, 5.0), grade="live")
    asyncio.run(Library.open(f"file://{tmp_path}/library").put("dance", pack("dance", encoded)))
    shown: list[int] = []

    async def watch(viewer: Viewer) -> Figures:
        return await viewer.watch(16.0, lambda reference, _: shown.append(reference))

    with network() as net, running(tmp_path, host="0.0.0.0") as url:
        port = url.rpartition(":")[2]
        with net.lines([Link(28_800, 75, cut=(4.0, 10.0))]) as (far,):
            viewer = Viewer(
                f"ws://{far.host}:{port}/v1/motions/dance/stream?tracks=motion", open_socket=far.open_socket
            )
            figures = asyncio.run(watch(viewer))
    assert figures.first_pose_ms is not None
    assert figures.first_pose_ms < 3_000
    assert figures.reconnects >= 1
    # the net that came before carried the dance over the cut
    assert figures.gaps == 0
    # the stage's time went on as the watching did, over the cut too
    assert 13e6 < shown[-1] - shown[0] < 18e6
    assert figures.reason in ("best", "line")
    assert figures.shown_kbps > 0
