"""Inspections of a server from inside: what power loss, a full disk, crashes and hostile files would do.

Each starts its own server. Rows 8, 9, 12, 13, 16 and 18.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from tests.attack.result import AttackResult


class Unsupported(Exception):
    """Missing program or privilege; the text names it."""


InspectionFunction = Callable[[AttackResult], None]


@dataclass(frozen=True)
class Inspection:
    """Inspection of one row; `function` adds answers and violations to the result."""

    name: str
    row: int
    criterion: str
    function: InspectionFunction
    is_quick: bool

    def run(self, skip: str = "") -> AttackResult:
        """Run the inspection, unless `skip` says why not."""
        result = AttackResult(self.name, self.row, self.criterion, skipped=skip)
        if not skip:
            try:
                self.function(result)
            except Unsupported as error:
                result.skipped = str(error)
            except Exception as error:
                result.violations.append(f"the inspection failed: {type(error).__name__}: {error}")
        return result


INSPECTIONS: dict[str, Inspection] = {}


def inspection(row: int, criterion: str, *, quick: bool = False) -> Callable[[InspectionFunction], InspectionFunction]:
    """Register a function as an inspection. Its name is that of the function."""

    def register(function: InspectionFunction) -> InspectionFunction:
        name = function.__name__.replace("_", " ")
        INSPECTIONS[name] = Inspection(name, row, criterion, function, quick)
        return function

    return register


def load_inspections() -> dict[str, Inspection]:
    """Import the modules with inspections and return them by name."""
    from tests.attack import inspect_process, inspect_storage  # noqa: F401 - importing them registers the inspections

    return dict(sorted(INSPECTIONS.items(), key=lambda item: item[1].row))
