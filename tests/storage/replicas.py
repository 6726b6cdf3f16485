"""Several processes that open a catalogue at the same instant: `python -m tests.storage.replicas URL COUNT`.

Each prints OK, or what went wrong.
"""

from __future__ import annotations

import asyncio
import os
import sys
import traceback

# loaded once, before the processes part
import alembic.command  # noqa: F401
import asyncpg  # noqa: F401

from bunraku.storage.catalogue_sql import SqlCatalogue
from bunraku.storage.record import CatalogueEntry


async def open_and_write(url: str, number: int) -> None:
    """Open the catalogue and use it."""
    catalogue = await SqlCatalogue.open(url)
    assert await catalogue.add_motion(CatalogueEntry(f"m{number}", number, {}))
    await catalogue.close()


def main() -> None:
    """Part, wait for the signal, open."""
    url, count = sys.argv[1], int(sys.argv[2])
    reading, writing = os.pipe()
    children = []
    for number in range(count):
        child = os.fork()
        if child == 0:
            os.close(writing)
            # all go on when the other end is closed
            os.read(reading, 1)
            try:
                asyncio.run(open_and_write(url, number))
                told = "OK"
            except BaseException:
                told = traceback.format_exc().replace("\n", "; ")
            # at once, so that no other comes between a line and its end
            os.write(1, f"{told}\n".encode())
            os._exit(0)
        children.append(child)
    os.close(writing)
    for child in children:
        os.waitpid(child, 0)


if __name__ == "__main__":
    main()
