"""Which parts of a bench are asked for on its command line."""

from __future__ import annotations

import argparse
from collections.abc import Collection


def parse_parts(about: str | None, parts: Collection[str]) -> list[str]:
    """The names given, all `parts` where none is; ends the program, with a word, for one that is not there. The first
    line of `about` says what the bench is."""
    parser = argparse.ArgumentParser(description=(about or "").partition("\n")[0])
    parser.add_argument("parts", nargs="*", help=f"of {', '.join(parts)}; default: all")
    given: list[str] = parser.parse_args().parts
    unknown = [part for part in given if part not in parts]
    if unknown:
        parser.error(f"parts are {', '.join(parts)}, not {unknown[0]}")
    return given or list(parts)
