from __future__ import annotations

import asyncio
from collections.abc import Iterator

import numpy as np
import pytest

from bunraku.client import Client, Viewer
from tests.servers import run_server
from tests.time_limit import HANG_TIMEOUT_S

pytest.importorskip("mujoco", reason="MuJoCo is not installed")

from examples.robot import stage
from examples.robot.rehearsal import pull_strings


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with run_server(tmp_path_factory.mktemp("robot"), demo=True) as url:
        yield url


async def test_robot_follows_two_people_and_dances_beside_the_puppet(
    server: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stage, "FIGURE_TIMEOUT_S", HANG_TIMEOUT_S)
    async with Client(server) as client:
        session = await client.first_session()
        assert session is not None
        people = [
            asyncio.create_task(pull_strings(client, session, side, HANG_TIMEOUT_S)) for side in ("left", "right")
        ]
        running = asyncio.create_task(stage.run_robot(client, session, 6.0, beside=1.5))
        viewer, distances = Viewer(client.socket_url(f"/v1/sessions/{session}/stream")), []
        seen = asyncio.Event()

        def on_frame(reference: int, _: object) -> None:
            puppet, robot = viewer.pose_at(reference, 0), viewer.pose_at(reference, 1)
            if puppet is not None and robot is not None:
                distances.append(robot[0] - puppet[0])
                seen.set()

        watching = asyncio.create_task(viewer.watch(HANG_TIMEOUT_S, on_frame))
        robot = await running
        for task in (watching, *people):
            task.cancel()
        held = await asyncio.gather(watching, *people, return_exceptions=True)
    assert all(isinstance(result, asyncio.CancelledError) for result in held), held
    assert seen.is_set()
    assert np.abs(np.array(distances) - [1.5, 0, 0]).max() < 1.2
    assert robot.measurement.limits_broken == 0
    assert robot.measurement.steps > 50


async def test_missing_performer_is_explained(server: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stage, "FIGURE_TIMEOUT_S", 0.5)
    async with Client(server) as client:
        session = await client.first_session()
        assert session is not None
        with pytest.raises(stage.StageError, match="Performer 3"):
            await stage.run_robot(client, session, 1.0, performer=3)
