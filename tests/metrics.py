"""Metrics of a server, read from `/metrics` in the Prometheus format."""

from __future__ import annotations

from collections.abc import Callable
from urllib.request import urlopen

from prometheus_client.parser import text_string_to_metric_families

from tests.time_limit import HANG_TIMEOUT_S


class MetricSamples:
    """Samples of one scrape."""

    def __init__(self, text: str) -> None:
        self.families = {family.name: family for family in text_string_to_metric_families(text)}
        self._samples = [sample for family in self.families.values() for sample in family.samples]

    def sum(self, name: str, **labels: str) -> float:
        """Return the sum of the samples with this name, without the prefix `bunraku_`, and these labels."""
        values = [s.value for s in self._samples if s.name == f"bunraku_{name}" and labels.items() <= s.labels.items()]
        return sum(values)

    def has(self, name: str) -> bool:
        """Return whether there is a sample with this name."""
        return any(sample.name == f"bunraku_{name}" for sample in self._samples)


def scrape_metrics(port: int) -> MetricSamples:
    """Read the metrics of the server at a local port."""
    with urlopen(f"http://127.0.0.1:{port}/metrics", timeout=HANG_TIMEOUT_S) as answer:
        assert answer.headers["Content-Type"].startswith("text/plain")
        return MetricSamples(answer.read().decode())


def scrape_until(port: int, condition: Callable[[MetricSamples], bool], max_attempts: int = 2000) -> MetricSamples:
    """Scrape until `condition` holds, and return the last scrape even if it never does."""
    for _ in range(max_attempts):
        samples = scrape_metrics(port)
        if condition(samples):
            break
    return samples
