"""Outputs of the One-Euro filter for samples at irregular, repeated and earlier times (`one_euro.json`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from bunraku.client.one_euro import OneEuro


def make_vectors() -> list[dict[str, Any]]:
    """Return runs of several settings, of vectors of one, two and three values."""
    random = np.random.default_rng(12)
    runs = []
    kinds = (((1.0, 0.0, 1.0), 1), ((1.5, 8.0, 1.0), 3), ((0.3, 2.0, 4.0), 2))
    for (min_cutoff, beta, derivative_cutoff), size in kinds:
        smooth, samples, seconds = OneEuro(min_cutoff, beta, derivative_cutoff), [], 10.0
        for i in range(40):
            seconds += (0.0, -0.004, 0.25)[i // 4 % 3] if i % 4 == 3 else float(random.uniform(0.002, 0.04))
            values = np.sin(3.0 * seconds + np.arange(size)) + random.normal(0, 0.05, size)
            time, sample = round(seconds, 6), [round(float(value), 6) for value in values]
            samples.append({"seconds": time, "values": sample, "filtered": list(smooth.filter(sample, time))})
        settings = {"min_cutoff": min_cutoff, "beta": beta, "derivative_cutoff": derivative_cutoff}
        runs.append({"settings": settings, "samples": samples})
    return runs
