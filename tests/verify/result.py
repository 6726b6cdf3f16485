"""The table: of each fault how often it was tried, how often all held, and the worst of each figure."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass
class FaultResult:
    """One fault."""

    fault: str
    attempts: int = 0
    passed: int = 0
    worst: dict[str, float] = field(default_factory=dict)
    violations: list[str] = field(default_factory=list)

    def add_round(self, figures: dict[str, float], *broken: str) -> None:
        """One time: its figures, of which the greatest is kept, and what did not hold."""
        self.attempts += 1
        self.passed += not broken
        self.violations += broken
        for name, value in figures.items():
            self.worst[name] = max(value, self.worst.get(name, value))

    def format_row(self) -> str:
        """As a line of the table."""
        figures = ", ".join(f"{name} {value:.3g}" for name, value in self.worst.items())
        said = f"{self.fault:<34} {self.passed}/{self.attempts}  {figures}"
        return "\n".join([said, *(f"{'':<34} did not hold: {why}" for why in dict.fromkeys(self.violations))])
