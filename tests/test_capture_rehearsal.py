"""`bunraku capture bvh`; tests/e2e/test_capture_stream.py plays a file to its end on a server."""

from __future__ import annotations

import asyncio
import json
import signal
import sys
from pathlib import Path

from bunraku.client import Client
from bunraku.motion.bvh_writer import write_bvh
from tests.capture.samples import sample_analysis
from tests.e2e.test_live import wait_for_live, watching
from tests.servers import run_server
from tests.time_limit import HANG_TIMEOUT_S


async def test_loop_repeats_the_file_until_it_is_stopped(tmp_path: Path) -> None:
    clip = tmp_path / "clip.bvh"
    motion = sample_analysis().motion
    clip.write_bytes(write_bvh(motion))
    with run_server(tmp_path / "data") as url:
        process = await asyncio.create_subprocess_exec(
            Path(sys.executable).parent / "bunraku", "capture", "bvh", clip, "--loop", "--server", url, "--json",
            stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE,
        )  # fmt: skip
        assert process.stderr is not None
        async with asyncio.timeout(HANG_TIMEOUT_S), Client(url) as client:
            session = (await process.stderr.readline()).decode().split()[-1].rpartition("=")[2]
            async with watching(client, session) as (viewer, _):
                # a message has two of sixty frames per second
                await wait_for_live(viewer, round(30 * (motion.duration + 1.0)))
            process.send_signal(signal.SIGTERM)
            output, errors = await process.communicate()
    assert process.returncode == 0, errors
    assert json.loads(output)["sent"] > motion.frame_count
