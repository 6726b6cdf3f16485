"""A server killed while it encodes: another server finishes the job without a second upload."""

from __future__ import annotations

import asyncio
import hashlib
import sys
from contextlib import ExitStack
from pathlib import Path

import httpx2
import pytest

from bunraku.storage.motion_id import derive_motion_id
from tests.processes import ServerProcess, free_port
from tests.servers import make_bvh_clip
from tests.time_limit import HANG_TIMEOUT_S


def make_ingest_process(folder: Path, name: str) -> ServerProcess:
    port = free_port()
    (folder / name).mkdir()
    arguments = ["up", "--service", "ingest", "--port", str(port), "--data", str(folder / "data")]
    return ServerProcess([sys.executable, "-m", "bunraku.cli", *arguments], port, folder / name)


def pending_sources(folder: Path) -> list[Path]:
    return list(folder.glob("*"))


async def test_job_of_a_killed_server_is_finished_by_another(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_COLOR", "1")
    upload = make_bvh_clip(40.0, 11)
    motion = derive_motion_id(hashlib.sha256(upload).digest())
    first, second = make_ingest_process(tmp_path, "first"), make_ingest_process(tmp_path, "second")
    with ExitStack() as stack:
        for process in (first, second):
            stack.callback(process.stop)
            await asyncio.to_thread(process.start)
        async with httpx2.AsyncClient(timeout=HANG_TIMEOUT_S) as http:
            one, two = (f"http://127.0.0.1:{process.port}/v1" for process in (first, second))
            query = {"filename": "long.bvh", "upload": "a-long-one"}
            sending = asyncio.create_task(http.post(f"{one}/motions", params=query, content=upload))
            async with asyncio.timeout(HANG_TIMEOUT_S):
                while True:
                    assert not sending.done(), "the upload was encoded before the server could be killed"
                    status = await http.get(f"{one}/uploads/a-long-one")
                    if status.status_code == 200 and status.json()["stage"] == "encoding":
                        break
            await asyncio.to_thread(first.kill)
            with pytest.raises(httpx2.TransportError):
                await sending
            assert (await http.get(f"{two}/motions")).json()["items"] == [], "an unfinished motion is listed"
            async with asyncio.timeout(HANG_TIMEOUT_S):
                while (await http.get(f"{two}/motions/{motion}")).status_code != 200:  # noqa: ASYNC110
                    await asyncio.sleep(0.2)
            (listed,) = (await http.get(f"{two}/motions")).json()["items"]
            assert (listed["id"], listed["filename"]) == (motion, "long.bvh")
            async with asyncio.timeout(HANG_TIMEOUT_S):
                while pending_sources(tmp_path / "data" / "library" / "sources"):  # noqa: ASYNC110
                    await asyncio.sleep(0.05)
