"""The whole stack, and what it survives: `make verify-compose`. The last line printed is one JSON object.

Needs Docker with Compose. The stack is built and started from this checkout, in a project of its own; a clip is
uploaded, watched by two viewers on different replicas, and pulled at through a session replica that is not its own;
then things break, each as often as is asked. Exits with 1 where something did not hold.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import sys
import tempfile
import time
from collections.abc import Coroutine
from pathlib import Path

from bunraku.client.api import Client
from tests.servers import make_bvh_clip
from tests.verify import process_fault, upload_fault
from tests.verify.result import FaultResult
from tests.verify.scenario import PROBE_SOURCE, open_scenario
from tests.verify.stack import REPOSITORY, Stack

CLIP_PATH = "mocap/bvh/cmu_12_01_walk.bvh"


def main() -> None:
    """Parse, run, print."""
    parser = argparse.ArgumentParser(prog="make verify-compose", description=__doc__.partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=5, help="how often each fault comes")
    parser.add_argument("--outage", type=float, default=30.0, help="seconds for which the broker or database is gone")
    parser.add_argument("--port", type=int, default=8080)
    parser.add_argument(
        "--only", default="", help="only faults that have one of these words in their names: kill,stop,gone,nats"
    )
    parser.add_argument("--keep", action="store_true", help="leave the stack running")
    asked = parser.parse_args()
    sys.exit(asyncio.run(verify(asked)))


async def verify(asked: argparse.Namespace) -> int:
    """Everything; 1 where something did not hold."""
    stack = Stack(asked.port)
    rows: list[FaultResult] = []
    figures: dict[str, float] = {}
    try:
        figures["up_s"] = await stack.up()
        figures["image_mb"] = await stack.image_megabytes()
        with tempfile.TemporaryDirectory(prefix="bunraku-verify-") as name:
            await _run_faults(stack, asked, Path(name), rows, figures)
    finally:
        if not asked.keep:
            await stack.down()
    passed = sum(row.passed for row in rows)
    failed = sum(row.attempts for row in rows) - passed
    worst = {row.fault: {name: round(value, 4) for name, value in row.worst.items()} for row in rows}
    told = {name: round(value, 3) for name, value in figures.items()}
    print(", ".join(f"{name} {value:g}" for name, value in told.items()))
    print(json.dumps({"passed": passed, "failed": failed, **told, "rows": worst}))
    return int(failed > 0 or not rows)


async def _run_faults(
    stack: Stack, asked: argparse.Namespace, folder: Path, rows: list[FaultResult], figures: dict[str, float]
) -> None:
    async with Client(stack.url) as client:
        began = time.monotonic()
        motion = (await client.upload(_select_clip(folder)))["id"]
        figures["upload_s"] = time.monotonic() - began
        demo = await client.first_session()
        assert demo is not None, "no stage is open: the demo's is missing"
    said = json.loads(await stack.exec_in_replica("stream", 1, "python", "-", "hop", stdin=PROBE_SOURCE))
    figures |= {f"hop_{name}_ms": said[name] for name in ("p50", "p99")}
    async with open_scenario(stack, motion) as scene:
        for watcher in scene.viewers:
            assert watcher.statistics.first_pose_ms is not None
        figures["first_pose_ms"] = max(one.statistics.first_pose_ms or 0.0 for one in scene.viewers)
        ways: list[tuple[str, Coroutine[None, None, FaultResult]]] = [
            *(
                (f"kill {name}", process_fault.kill_service(scene, name, folder, asked.rounds))
                for name in process_fault.KILL_TARGETS
            ),
            ("full", upload_fault.fill_disk(scene, asked.rounds)),
            ("cut", upload_fault.interrupt_upload(scene, asked.rounds)),
            ("encoding", upload_fault.kill_while_encoding(scene, asked.rounds)),
            ("moved", process_fault.stop_one_stream_replica(scene, asked.rounds)),
            ("stop", process_fault.stop_stream_service(scene, asked.rounds)),
            *(
                (f"gone {name}", process_fault.run_outage(scene, name, folder, asked.rounds, asked.outage))
                for name in ("nats", "postgres")
            ),
        ]
        for name, way in ways:
            if not any(word in name for word in asked.only.split(",")):
                way.close()
                continue
            rows.append(await way)
            print(rows[-1].format_row(), flush=True)


def _select_clip(folder: Path) -> Path:
    """A real clip where there are some, else one that is made."""
    shared = Path(os.environ.get("BUNRAKU_SHARED") or REPOSITORY.parent / "shared") / CLIP_PATH
    if shared.is_file():
        return shared
    made = folder / "made.bvh"
    made.write_bytes(make_bvh_clip(20.0, 7))
    return made


if __name__ == "__main__":
    main()
