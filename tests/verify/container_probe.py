"""What is asked from within the stack, by a Python of the image: read from standard input, with one argument.

`hop`: how long messages take from one publisher through the bus to one who listens. A session's id: whether an input
was applied to its puppet more than once, by its own log.
"""

import asyncio
import json
import sys
import time

import msgpack

from bunraku.messaging.bus_nats import NatsBus
from bunraku.runtime.context import open_context
from bunraku.runtime.settings import Settings

MESSAGE_COUNT = 600
MESSAGE_BYTES = 66
MESSAGE_RATE_HZ = 60.0


async def measure_bus_latency() -> dict[str, float]:
    """Milliseconds, of messages as overlays are."""
    one, other = NatsBus(Settings().bus), NatsBus(Settings().bus)
    late: list[float] = []

    def hear(data: bytes) -> None:
        late.append((time.monotonic_ns() - int.from_bytes(data[:8], "little")) * 1e-6)

    for bus in (one, other):
        await bus.open()
    other.subscribe("verify.hop", hear)
    await asyncio.sleep(0.5)
    for _ in range(MESSAGE_COUNT):
        one.publish("verify.hop", time.monotonic_ns().to_bytes(8, "little") + bytes(MESSAGE_BYTES - 8))
        await asyncio.sleep(1 / MESSAGE_RATE_HZ)
    await asyncio.sleep(0.5)
    for bus in (one, other):
        await bus.close()
    late.sort()
    return {"sent": MESSAGE_COUNT, "heard": len(late), "p50": late[len(late) // 2], "p99": late[len(late) * 99 // 100]}


async def count_inputs(session: str) -> dict[str, int]:
    """How many inputs were applied, and how many of them a second time."""
    from bunraku.marionette import input_log
    from bunraku.marionette.recorder import CommandKind

    async with open_context(Settings()) as backing:
        said = msgpack.unpackb(await backing.bus.request(f"session.{session}.log", msgpack.packb(60.0), 10.0))
        name = said["answer"]["log"]
        data = await backing.motion_store.get_log(name)
        await backing.motion_store.remove_log(name)
    assert data is not None
    seen: list[tuple[int, ...]] = []
    for passage in input_log.InputLog.unpack(data)._segments:
        at = 0
        while at < len(passage.records):
            kind = CommandKind(passage.records[at])
            layout = input_log._RECORDS[kind]
            if kind is CommandKind.INPUT:
                _, who, limb, _, epoch, sequence, *_ = layout.unpack_from(passage.records, at + 1)
                seen.append((who, limb, epoch, sequence))
            at += 1 + layout.size
    return {"applied": len(seen), "twice": len(seen) - len(set(seen))}


argument = sys.argv[1]
print(json.dumps(asyncio.run(measure_bus_latency() if argument == "hop" else count_inputs(argument))))
