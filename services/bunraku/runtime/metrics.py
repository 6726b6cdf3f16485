"""The numbers of one process, for Prometheus: what the services count is read when somebody asks, and not before.

What is counted often is counted in plain integers where it happens, as a viewer's overlay must not wait for a lock.
Each service hands functions that read them, which are called in the thread that answers: they may find that something
changes meanwhile, and are then called again.
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
"""Times that a number is read which changes while it is read."""
DURATION_BOUNDS_S = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0)
"""Bounds for what people wait for."""

LabelValues = tuple[str, ...]
MetricReader = Callable[[], float | Mapping[LabelValues, float]]
"""Reads one number, or one for each set of labels' values."""

_log = logging.getLogger(__name__)


class MetricsListenError(Exception):
    """The address of the metrics is not to be had."""


def parse_address(text: str) -> tuple[str, int]:
    """The host and port of `host:port` or `[::1]:port`; raises ValueError for anything else."""
    try:
        parts = urlsplit(f"//{text}")
        host, port = parts.hostname, parts.port
        fine = bool(host and port) and parts.netloc == text and parts.username is None
        if host and ":" in host:
            ipaddress.IPv6Address(host)
    except ValueError:
        fine = False
    if not fine or host is None or port is None:
        raise ValueError(f"metrics are at host:port, 127.0.0.1:9100 say, not {text[:80]!r}")
    return host, port


class Histogram:
    """How long something takes, in seconds: how many were at most each of `bounds`. For one thread to add to."""

    __slots__ = ("bounds", "counts", "total_s")

    def __init__(self, bounds: Sequence[float] = DURATION_BOUNDS_S) -> None:
        self.bounds = tuple(bounds)
        self.counts = [0] * (len(self.bounds) + 1)
        self.total_s = 0.0

    def observe(self, seconds: float) -> None:
        """One more."""
        self.counts[bisect_left(self.bounds, seconds)] += 1
        self.total_s += seconds

    def cumulative_buckets(self) -> list[tuple[str, float]]:
        """Cumulative, as Prometheus has them."""
        found, sum_ = [], 0
        for bound, count in zip((*map(str, self.bounds), "+Inf"), tuple(self.counts), strict=True):
            sum_ += count
            found.append((bound, float(sum_)))
        return found


class LabelledHistograms:
    """One for each set of labels' values, made when it is first added to."""

    def __init__(self, bounds: Sequence[float] = DURATION_BOUNDS_S) -> None:
        self._by_labels: dict[LabelValues, Histogram] = defaultdict(lambda: Histogram(bounds))

    def observe(self, labels: LabelValues, seconds: float) -> None:
        """One more with these."""
        self._by_labels[labels].observe(seconds)

    def __call__(self) -> Mapping[LabelValues, Histogram]:
        """All, by their labels."""
        return self._by_labels.copy()


class Metrics:
    """Of one process, or of one of several servers in it. A name that is taken raises ValueError."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        ProcessCollector(registry=self.registry)
        PlatformCollector(registry=self.registry)
        GCCollector(registry=self.registry)

    def gauge(self, name: str, description: str, read: MetricReader, labels: Sequence[str] = ()) -> None:
        """What goes up and down; `name` is without `bunraku_`."""
        self._register(GaugeMetricFamily, name, description, read, labels)

    def counter(self, name: str, description: str, read: MetricReader, labels: Sequence[str] = ()) -> None:
        """What only grows; its `name`, without `bunraku_`, ends with `_total`."""
        self._register(CounterMetricFamily, name, description, read, labels)

    def histogram(self, name: str, description: str, source: Histogram) -> None:
        """How long something takes; its `name`, without `bunraku_`, ends with `_seconds`."""
        self.histograms(name, description, lambda: {(): source}, ())

    def histograms(
        self, name: str, description: str, read: Callable[[], Mapping[LabelValues, Histogram]], labels: Sequence[str]
    ) -> None:
        """How long things of several kinds take."""

        def collect() -> Metric:
            family = HistogramMetricFamily(f"bunraku_{name}", description, labels=labels)
            for values, one in read().items():
                family.add_metric(values, one.cumulative_buckets(), one.total_s)
            return family

        self.registry.register(_Collector(HistogramMetricFamily(f"bunraku_{name}", description), collect))

    def _register(
        self, family_type: Any, name: str, description: str, read: MetricReader, labels: Sequence[str]
    ) -> None:
        def collect() -> Metric:
            family: Metric = family_type(f"bunraku_{name}", description, labels=labels)
            found = read()
            for values, number in (found if isinstance(found, Mapping) else {(): found}).items():
                family.add_metric(values, number)  # type: ignore[attr-defined]
            return family

        self.registry.register(_Collector(family_type(f"bunraku_{name}", description), collect))

    @contextmanager
    def serve(self, address: str) -> Iterator[None]:
        """Answer `GET /metrics` at `host:port`, in a thread of its own, until the block ends; where `address` is empty
        nobody is answered. Raises `CannotListen`."""
        if not address:
            yield
            return
        host, port = parse_address(address)
        try:
            server, thread = start_http_server(port, host, self.registry)
        except OSError as error:
            raise MetricsListenError(
                f"Cannot listen for metrics at {address}: {error.strerror}. BUNRAKU_METRICS says where."
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
        """As the registry has it; what cannot be read is left out, so that the rest is told."""
        for _ in range(MAX_READ_ATTEMPTS):
            # a set or a dict that grew while it was walked through says so with this
            with contextlib.suppress(RuntimeError):
                return [self._collect_family()]
        _log.warning("a number could not be read: it changed %d times meanwhile", MAX_READ_ATTEMPTS)
        return []

    def describe(self) -> Iterable[Metric]:
        """As the registry has it, which refuses a name that another has; nothing is read for that."""
        return [self._descriptor]


def _restrict_to_metrics_path(app: Any) -> Any:
    def answer(environ: dict[str, Any], start: Callable[..., Any]) -> Iterable[bytes]:
        if environ.get("PATH_INFO") != METRICS_PATH:
            start("404 Not Found", [("Content-Type", "text/plain; charset=utf-8")])
            return [b"Metrics are at /metrics, and nothing else is here.\n"]
        if environ.get("REQUEST_METHOD") not in ("GET", "HEAD"):
            start("405 Method Not Allowed", [("Content-Type", "text/plain; charset=utf-8"), ("Allow", "GET, HEAD")])
            return [b"GET /metrics.\n"]
        answered: Iterable[bytes] = app(environ, start)
        return answered

    return answer
