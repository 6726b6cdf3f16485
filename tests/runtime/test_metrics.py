from __future__ import annotations

import socket
import threading
from collections import Counter

import httpx2
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.runtime.metrics import (
    DURATION_BOUNDS_S,
    Histogram,
    LabelledHistograms,
    Metrics,
    MetricsListenError,
    parse_address,
)
from tests.metrics import MetricSamples, scrape_metrics
from tests.processes import free_port


@pytest.mark.parametrize(
    ("text", "address"),
    [("127.0.0.1:9100", ("127.0.0.1", 9100)), ("[::1]:9100", ("::1", 9100)), ("localhost:1", ("localhost", 1))],
)
def test_address_is_host_and_port(text: str, address: tuple[str, int]) -> None:
    assert parse_address(text) == address


@pytest.mark.parametrize(
    "text",
    ["9100", ":9100", "localhost", "localhost:", "localhost:0", "localhost:70000", "localhost:9100/metrics", "a b:c",
     "http://localhost:9100", "me@localhost:9100", "[::1:9100", "[localhost]:9100", "localhost:-1"],
)  # fmt: skip
def test_invalid_address_is_rejected_with_an_example(text: str) -> None:
    with pytest.raises(ValueError, match=r"expected host:port, for example 127\.0\.0\.1:9100"):
        parse_address(text)


@given(st.lists(st.floats(0, 100)))
def test_histogram_counts_each_value_once_and_cumulates(values: list[float]) -> None:
    histogram = Histogram()
    for value in values:
        histogram.observe(value)
    for bound, count in histogram.cumulative_buckets():
        assert count == sum(value <= float(bound) for value in values)
    assert histogram.cumulative_buckets()[-1] == ("+Inf", len(values))
    assert histogram.total_s == pytest.approx(sum(values))
    assert len(histogram.cumulative_buckets()) == len(DURATION_BOUNDS_S) + 1


def test_values_are_read_at_scrape_from_separate_registries() -> None:
    metrics, other, seen = Metrics(), Metrics(), Counter[tuple[str, ...]]({("a",): 2})
    metrics.gauge("viewers", "Viewers", lambda: len(seen))
    metrics.counter("connections_total", "Connections", seen.copy, ("route",))
    times = LabelledHistograms()
    metrics.histograms("wait_seconds", "Waiting", times, ("route",))
    other.gauge("viewers", "Viewers", lambda: 7)
    port, second = free_port(), free_port()
    with metrics.serve(f"127.0.0.1:{port}"), other.serve(f"127.0.0.1:{second}"):
        samples = scrape_metrics(port)
        assert (samples.sum("viewers"), samples.sum("connections_total", route="a")) == (1, 2)
        seen["b",] += 5
        times.observe(("b",), 0.3)
        samples = scrape_metrics(port)
        assert (samples.sum("viewers"), samples.sum("connections_total", route="b")) == (2, 5)
        assert samples.sum("wait_seconds_bucket", route="b", le="0.25") == 0
        assert samples.sum("wait_seconds_bucket", route="b", le="0.5") == samples.sum("wait_seconds_count") == 1
        assert {"process_resident_memory_bytes", "python_info"} <= samples.families.keys()
        assert scrape_metrics(second).sum("viewers") == 7
        assert not scrape_metrics(second).has("connections_total")
    # thread and port are released
    socket.create_server(("127.0.0.1", port)).close()
    assert not [thread for thread in threading.enumerate() if thread.daemon and "serve_forever" in thread.name]


def test_duplicate_name_is_rejected() -> None:
    metrics = Metrics()
    metrics.gauge("viewers", "Viewers", lambda: 1)
    with pytest.raises(ValueError, match="bunraku_viewers"):
        metrics.counter("viewers_total", "Viewers", lambda: 1)


def test_only_metrics_path_is_served() -> None:
    metrics, port = Metrics(), free_port()
    with metrics.serve(f"127.0.0.1:{port}"), httpx2.Client(base_url=f"http://127.0.0.1:{port}") as http:
        for path in ("/", "/metrics/", "/v1/sessions", "/favicon.ico", "//metrics"):
            assert http.get(path).status_code == 404, path
        assert http.post("/metrics").status_code == 405
        assert http.get("/metrics").status_code == 200


def test_unreadable_metric_is_omitted() -> None:
    metrics, port = Metrics(), free_port()
    growing = iter([RuntimeError("set changed size during iteration")] * 2)

    def read() -> float:
        if (error := next(growing, None)) is not None:
            raise error
        return 3

    def fail() -> float:
        raise RuntimeError("dictionary changed size during iteration")

    metrics.gauge("growing", "Changes during two reads", read)
    metrics.gauge("never", "Changes during every read", fail)
    with metrics.serve(f"127.0.0.1:{port}"):
        samples = scrape_metrics(port)
    assert samples.sum("growing") == 3
    assert not samples.has("never")


def test_address_in_use_is_reported_with_the_setting() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        address = f"127.0.0.1:{listener.getsockname()[1]}"
        with (
            pytest.raises(MetricsListenError, match=rf"{address}: .*Set BUNRAKU_METRICS"),
            Metrics().serve(address),
        ):
            pass


def test_empty_address_starts_no_listener() -> None:
    before = threading.active_count()
    with Metrics().serve(""):
        assert threading.active_count() == before


def test_sample_parser_sums_by_label() -> None:
    assert MetricSamples('bunraku_x_total{a="b"} 3\nbunraku_x_total{a="c"} 4\n').sum("x_total", a="c") == 4
