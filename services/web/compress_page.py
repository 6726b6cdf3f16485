"""Compress the built page, so that the server compresses nothing: `python compress_page.py FOLDER`.

Each file that is text, a program or a model gets a copy with Brotli (`.br`, RFC 7932) and one with gzip (`.gz`, RFC
1952). Browsers accept Brotli only over TLS and from their own machine. With gzip, Zopfli's files are 4 % smaller than
those of zlib.
"""

import gzip
import sys
from pathlib import Path

import brotli
from zopfli.gzip import compress as compress_small

SUFFIXES = frozenset([".binarypb", ".css", ".data", ".html", ".js", ".json", ".svg", ".txt", ".wasm", ".webmanifest"])
MIN_BYTES = 1000
"""Smaller files fit into one packet with their headers."""
MAX_ZOPFLI_BYTES = 1 << 20
"""Zopfli takes about three seconds for a megabyte."""


def compress_page(folder: Path) -> None:
    """Write the compressed copies of the files in `folder`, beside them."""
    for path in sorted(folder.rglob("*")):
        if path.suffix not in SUFFIXES or path.stat().st_size < MIN_BYTES:
            continue
        content = path.read_bytes()
        is_small = len(content) <= MAX_ZOPFLI_BYTES
        zipped = compress_small(content) if is_small else gzip.compress(content, mtime=0)
        path.with_name(path.name + ".br").write_bytes(brotli.compress(content))
        path.with_name(path.name + ".gz").write_bytes(zipped)


if __name__ == "__main__":
    compress_page(Path(sys.argv[1]))
