from __future__ import annotations

import io
import wave

import numpy as np

from bunraku.demo.wav import write_wav


def test_wav_reads_back() -> None:
    samples = np.random.default_rng(1).uniform(-1.2, 1.2, (1000, 2))
    with wave.open(io.BytesIO(write_wav(samples))) as file:
        assert (file.getnchannels(), file.getframerate(), file.getsampwidth(), file.getnframes()) == (
            2,
            48_000,
            2,
            1000,
        )
        values = np.frombuffer(file.readframes(1000), "<i2").reshape(-1, 2) / 32_767
    np.testing.assert_allclose(values, np.clip(samples, -1, 1), atol=1 / 32_767)
