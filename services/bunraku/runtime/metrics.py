"""Metrics of one process in the format of Prometheus, read when they are scraped.

Services count in plain integers, so that sending an overlay never waits for a lock, and register functions that read
them. The functions run in the thread that serves the scrape. If a collection changes while it is read, the function is
called again.
"""

from __future__ import annotations

import contextlib
import ipaddress
import logging
from bisect import bisect_left
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

from prometheus_client import CollectorRegistry, GCCollector, PlatformCollector, ProcessCollector, make_wsgi_app
from prometheus_client.exposition import start_http_server
from prometheus_client.metrics_core import CounterMetricFamily, GaugeMetricFamily, HistogramMetricFamily, Metric
from prometheus_client.registry import Collector

METRICS_PATH = "/metrics"
MAX_READ_ATTEMPTS = 5
"""Number of attempts to read a metric that changes while it is read."""
DURATION_BOUNDS_S = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0)
"""Bucket bounds for request and job durations, in seconds."""

LabelValues = tuple[str, ...]
MetricReader = Callable[[], float | Mapping[LabelValues, float]]
"""Function that returns one number, or one for each combination of label values."""

_log = logging.getLogger(__name__)


class MetricsListenError(Exception):
    """The address for metrics cannot be listened at."""


def parse_address(text: str) -> tuple[str, int]:
    """Return the host and port of `host:port` or `[::1]:port`; raise ValueError for anything else."""
    try:
        parts = urlsplit(f"//{text}")
        host, port = parts.hostname, parts.port
        valid = bool(host and port) and parts.netloc == text and parts.username is None
        if host and ":" in host:
            ipaddress.IPv6Address(host)
    except ValueError:
        valid = False
    if not valid or host is None or port is None:
        raise ValueError(f"invalid metrics address {text[:80]!r}, expected host:port, for example 127.0.0.1:9100")
    return host, port


class Histogram:
    """Histogram of durations in seconds, with buckets at `bounds`. One thread may add values."""

    __slots__ = ("bounds", "counts", "total_s")

    def __init__(self, bounds: Sequence[float] = DURATION_BOUNDS_S) -> None:
        self.bounds = tuple(bounds)
        self.counts = [0] * (len(self.bounds) + 1)
        self.total_s = 0.0

    def observe(self, seconds: float) -> None:
        """Add one value."""
        self.counts[bisect_left(self.bounds, seconds)] += 1
        self.total_s += seconds

    def cumulative_buckets(self) -> list[tuple[str, float]]:
        """Return (upper bound, cumulative count) of each bucket."""
        buckets, cumulative = [], 0
        for bound, count in zip((*map(str, self.bounds), "+Inf"), tuple(self.counts), strict=True):
            cumulative += count
            buckets.append((bound, float(cumulative)))
        return buckets


class LabelledHistograms:
    """Histograms by label values, created at the first value."""

    def __init__(self, bounds: Sequence[float] = DURATION_BOUNDS_S) -> None:
        self._by_labels: dict[LabelValues, Histogram] = defaultdict(lambda: Histogram(bounds))

    def observe(self, labels: LabelValues, seconds: float) -> None:
        """Add one value to the histogram of `labels`."""
        self._by_labels[labels].observe(seconds)

    def __call__(self) -> Mapping[LabelValues, Histogram]:
        """Return all histograms by their label values."""
        return self._by_labels.copy()


class Metrics:
    """Metrics of one process, or of one of several servers in it.

    Names are given without the prefix `bunraku_`. Registering a name twice raises ValueError.
    """

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        ProcessCollector(registry=self.registry)
        PlatformCollector(registry=self.registry)
        GCCollector(registry=self.registry)

    def gauge(self, name: str, description: str, read: MetricReader, labels: Sequence[str] = ()) -> None:
        """Register a value that goes up and down."""
        self._register(GaugeMetricFamily, name, description, read, labels)

    def counter(self, name: str, description: str, read: MetricReader, labels: Sequence[str] = ()) -> None:
        """Register a value that only grows; its `name` ends with `_total`."""
        self._register(CounterMetricFamily, name, description, read, labels)

    def histogram(self, name: str, description: str, source: Histogram) -> None:
        """Register a histogram of durations; its `name` ends with `_seconds`."""
        self.histograms(name, description, lambda: {(): source}, ())

    def histograms(
        self, name: str, description: str, read: Callable[[], Mapping[LabelValues, Histogram]], labels: Sequence[str]
    ) -> None:
        """Register histograms of durations by label values."""

        def collect() -> Metric:
            family = HistogramMetricFamily(f"bunraku_{name}", description, labels=labels)
            for values, source in read().items():
                family.add_metric(values, source.cumulative_buckets(), source.total_s)
            return family

        self.registry.register(_Collector(HistogramMetricFamily(f"bunraku_{name}", description), collect))

    def _register(
        self, family_type: Any, name: str, description: str, read: MetricReader, labels: Sequence[str]
    ) -> None:
        def collect() -> Metric:
            family: Metric = family_type(f"bunraku_{name}", description, labels=labels)
            current = read()
            for values, value in (current if isinstance(current, Mapping) else {(): current}).items():
                family.add_metric(values, value)  # type: ignore[attr-defined]
            return family

        self.registry.register(_Collector(family_type(f"bunraku_{name}", description), collect))

    @contextmanager
    def serve(self, address: str) -> Iterator[None]:
        """Serve `GET /metrics` at `host:port` from a separate thread until the block ends.

        An empty `address` serves nothing. Raise `MetricsListenError` if the address cannot be used.
        """
        if not address:
            yield
            return
        host, port = parse_address(address)
        try:
            server, thread = start_http_server(port, host, self.registry)
        except OSError as error:
            raise MetricsListenError(
                f"Cannot listen for metrics at {address}: {error.strerror}. Set BUNRAKU_METRICS to a free address."
            ) from None
        server.set_app(_restrict_to_metrics_path(make_wsgi_app(self.registry)))
        try:
            yield
        finally:
            server.shutdown()
            server.server_close()
            thread.join()


class _Collector(Collector):
    def __init__(self, descriptor: Metric, collect: Callable[[], Metric]) -> None:
        self._descriptor = descriptor
        self._collect_family = collect

    def collect(self) -> Iterable[Metric]:
        # a metric that cannot be read is omitted, so that the others are still served
        for _ in range(MAX_READ_ATTEMPTS):
            # raised by a set or a dict that grows during iteration
            with contextlib.suppress(RuntimeError):
                return [self._collect_family()]
        _log.warning("Metric not read: it changed during each of %d attempts", MAX_READ_ATTEMPTS)
        return []

    def describe(self) -> Iterable[Metric]:
        # lets the registry reject duplicate names without reading values
        return [self._descriptor]


def _restrict_to_metrics_path(app: Any) -> Any:
    def serve_metrics(environ: dict[str, Any], start: Callable[..., Any]) -> Iterable[bytes]:
        if environ.get("PATH_INFO") != METRICS_PATH:
            start("404 Not Found", [("Content-Type", "text/plain; charset=utf-8")])
            return [b"Not found. Metrics are served at /metrics.\n"]
        if environ.get("REQUEST_METHOD") not in ("GET", "HEAD"):
            start("405 Method Not Allowed", [("Content-Type", "text/plain; charset=utf-8"), ("Allow", "GET, HEAD")])
            return [b"Method not allowed. Use GET /metrics.\n"]
        body: Iterable[bytes] = app(environ, start)
        return body

    return serve_metrics
