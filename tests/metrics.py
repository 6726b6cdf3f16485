"""What a server says at `/metrics`, as Prometheus reads it."""

from __future__ import annotations

from collections.abc import Callable
from urllib.request import urlopen

from prometheus_client.parser import text_string_to_metric_families


class MetricSamples:
    """All samples of one look."""

    def __init__(self, text: str) -> None:
        self.families = {family.name: family for family in text_string_to_metric_families(text)}
        self._samples = [sample for family in self.families.values() for sample in family.samples]

    def sum(self, name: str, **labels: str) -> float:
        """Of the samples of this name that have these labels; `name` is without `bunraku_`."""
        found = [s.value for s in self._samples if s.name == f"bunraku_{name}" and labels.items() <= s.labels.items()]
        return sum(found)

    def has(self, name: str) -> bool:
        """Whether there is any."""
        return any(sample.name == f"bunraku_{name}" for sample in self._samples)


def scrape_metrics(port: int) -> MetricSamples:
    """Look now."""
    with urlopen(f"http://127.0.0.1:{port}/metrics", timeout=10) as answer:
        assert answer.headers["Content-Type"].startswith("text/plain")
        return MetricSamples(answer.read().decode())


def scrape_until(port: int, condition: Callable[[MetricSamples], bool], max_attempts: int = 2000) -> MetricSamples:
    """Look until it is fine; the last look where it never is."""
    for _ in range(max_attempts):
        found = scrape_metrics(port)
        if condition(found):
            break
    return found
