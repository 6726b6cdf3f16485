"""Open a catalogue in several processes at the same instant: `python -m tests.storage.replicas URL COUNT`.

Each process prints OK or its traceback.
"""

from __future__ import annotations

import asyncio
import os
import sys
import traceback

# imported once, before the forks
import alembic.command  # noqa: F401
import asyncpg  # noqa: F401

from bunraku.storage.catalogue_sql import SqlCatalogue
from bunraku.storage.record import CatalogueEntry


async def open_and_write(url: str, number: int) -> None:
    """Open the catalogue and add a motion."""
    catalogue = await SqlCatalogue.open(url)
    assert await catalogue.add_motion(CatalogueEntry(f"m{number}", number, {}))
    await catalogue.close()


def main() -> None:
    """Fork the processes and start them at the same instant."""
    url, count = sys.argv[1], int(sys.argv[2])
    read_end, write_end = os.pipe()
    children = []
    for number in range(count):
        child = os.fork()
        if child == 0:
            os.close(write_end)
            # returns in all processes when the other end is closed
            os.read(read_end, 1)
            try:
                asyncio.run(open_and_write(url, number))
                outcome = "OK"
            except BaseException:
                outcome = traceback.format_exc().replace("\n", "; ")
            # a single write, so that lines of processes do not mix
            os.write(1, f"{outcome}\n".encode())
            os._exit(0)
        children.append(child)
    os.close(write_end)
    for child in children:
        os.waitpid(child, 0)


if __name__ == "__main__":
    main()
