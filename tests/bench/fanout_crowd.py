"""Load generator in a separate process, controlled by lines: `python -m tests.bench.fanout_crowd URL [talk]`.

Each line of standard input is a command, answered with one JSON object: `join VIEWERS A_SECOND`, `count` (reset the
statistics), `figures` (statistics since the reset, in milliseconds: those of `LoadGenerator`, `overlay_p99` and
`overlay_max`, the lateness, and `block_spread`, between the 5th and 95th percentile of a hundred blocks due at once),
`leave VIEWERS`. With `talk` each viewer sends reports and pings, else they only answer WebSocket pings.
"""

from __future__ import annotations

import asyncio
import json
import sys
from typing import Any

import numpy as np
import uvloop

from bunraku.client.load_generator import LoadGenerator


async def run(url: str, quiet: bool) -> None:
    """Execute the commands of standard input until it ends."""
    generator = LoadGenerator(url, single_reporter=quiet)
    while line := await asyncio.to_thread(sys.stdin.readline):
        command, *numbers = line.split()
        reply: dict[str, Any] = {}
        if command == "join":
            await generator.join(int(numbers[0]), float(numbers[1]))
        elif command == "leave":
            await generator.leave(int(numbers[0]))
        elif command == "count":
            generator.reset_statistics()
        else:
            lateness, blocks = np.array(generator.state.overlay_lateness), np.array(generator.state.block_lateness)
            reply = generator.statistics().as_json()
            if lateness.size:
                reply |= {
                    "overlay_p99": float(np.percentile(lateness, 99)) / 1e3,
                    "overlay_max": float(lateness.max()) / 1e3,
                }
            if blocks.size:
                reply["block_spread"] = float(np.percentile(blocks, 95) - np.percentile(blocks, 5)) / 1e3
        print(json.dumps(reply | {"joined": len(generator.viewers), "refused": generator.refused}), flush=True)


if __name__ == "__main__":
    uvloop.run(run(sys.argv[1], sys.argv[2:] != ["talk"]))
