"""Command line of benchmarks that consist of parts."""

from __future__ import annotations

import argparse
from collections.abc import Collection


def parse_parts(about: str | None, parts: Collection[str]) -> list[str]:
    """Return the parts named on the command line, all `parts` if there are none; exit with an error for an unknown one.

    The first line of `about` is the description of the benchmark."""
    parser = argparse.ArgumentParser(description=(about or "").partition("\n")[0])
    parser.add_argument("parts", nargs="*", help=f"any of {', '.join(parts)}; default: all")
    requested: list[str] = parser.parse_args().parts
    unknown = [part for part in requested if part not in parts]
    if unknown:
        parser.error(f"unknown part {unknown[0]}: choose from {', '.join(parts)}")
    return requested or list(parts)
