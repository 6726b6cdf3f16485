"""Results by fault: attempts, passed attempts, and the worst value of each figure."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass
class FaultResult:
    """Result of one fault."""

    fault: str
    attempts: int = 0
    passed: int = 0
    worst: dict[str, float] = field(default_factory=dict)
    violations: list[str] = field(default_factory=list)

    def add_round(self, figures: dict[str, float], *violations: str) -> None:
        """Add one attempt: its figures, of which the maximum is kept, and its violations."""
        self.attempts += 1
        self.passed += not violations
        self.violations += violations
        for name, value in figures.items():
            self.worst[name] = max(value, self.worst.get(name, value))

    def format_row(self) -> str:
        """Format the result as a row of the table."""
        figures = ", ".join(f"{name} {value:.3g}" for name, value in self.worst.items())
        row = f"{self.fault:<34} {self.passed}/{self.attempts}  {figures}"
        return "\n".join([row, *(f"{'':<34} failed: {violation}" for violation in dict.fromkeys(self.violations))])
