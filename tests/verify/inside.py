"""What is asked from within the stack, by a Python of the image: read from standard input, with one argument.

`hop`: how long messages take from one publisher through the bus to one who listens. A session's id: whether an input
was applied to its puppet more than once, by its own log.
"""

import asyncio
import json
import sys
import time

import msgpack

from bunraku.backing.backing import open_backing
from bunraku.backing.bus_nats import NatsBus
from bunraku.backing.settings import Settings

MESSAGES = 600
BYTES = 66
HERTZ = 60.0


async def hop() -> dict[str, float]:
    """Milliseconds, of messages as overlays are."""
    one, other = NatsBus(Settings().bus), NatsBus(Settings().bus)
    late: list[float] = []

    def hear(data: bytes) -> None:
        late.append((time.monotonic_ns() - int.from_bytes(data[:8], "little")) * 1e-6)

    for bus in (one, other):
        await bus.open()
    other.subscribe("verify.hop", hear)
    await asyncio.sleep(0.5)
    for _ in range(MESSAGES):
        one.publish("verify.hop", time.monotonic_ns().to_bytes(8, "little") + bytes(BYTES - 8))
        await asyncio.sleep(1 / HERTZ)
    await asyncio.sleep(0.5)
    for bus in (one, other):
        await bus.close()
    late.sort()
    return {"sent": MESSAGES, "heard": len(late), "p50": late[len(late) // 2], "p99": late[len(late) * 99 // 100]}


async def inputs(session: str) -> dict[str, int]:
    """How many inputs were applied, and how many of them a second time."""
    from bunraku.marionette import log

    async with open_backing(Settings()) as backing:
        said = msgpack.unpackb(await backing.bus.ask(f"session.{session}.log", msgpack.packb(60.0), 10.0))
        name = said["answer"]["log"]
        data = await backing.library.get_log(name)
        await backing.library.remove_log(name)
    assert data is not None
    seen: list[tuple[int, ...]] = []
    for passage in log.Log.unpack(data)._passages:
        at = 0
        while at < len(passage.records):
            layout = log._RECORDS[passage.records[at]]
            if passage.records[at] == log._INPUT:
                _, who, limb, _, epoch, sequence, *_ = layout.unpack_from(passage.records, at + 1)
                seen.append((who, limb, epoch, sequence))
            at += 1 + layout.size
    return {"applied": len(seen), "twice": len(seen) - len(set(seen))}


asked = sys.argv[1]
print(json.dumps(asyncio.run(hop() if asked == "hop" else inputs(asked))))
