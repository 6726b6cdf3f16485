/** Fake AudioContext that plays scheduled sources as its time is advanced. */

class FakeAudioNode {
  constructor(readonly device: FakeAudioContext) {}
  connect(): void {}
  disconnect(): void {}
}

class FakeGainNode extends FakeAudioNode {
  /** Time from which the output is muted, in seconds. */
  cut = Infinity;
  readonly gain = { value: 1, setTargetAtTime: (goal: number, when: number) => goal === 0 && (this.cut = when) };
}

class FakeSourceNode extends EventTarget {
  buffer: { planes: Float32Array[] } | null = null;
  bus: FakeGainNode | null = null;
  begin = Infinity;
  stopped = false;
  ended = false;
  connect(bus: FakeGainNode): void {
    this.bus = bus;
  }
  disconnect(): void {}
  start(when: number): void {
    this.begin = when;
  }
  stop(): void {
    this.stopped = true;
  }
}

export class FakeAudioContext {
  state: AudioContextState = "running";
  /** Time in seconds, one render quantum ahead of the output. */
  currentTime = 0;
  /** Output by frame, and the number of sources that contributed. */
  readonly output: { sample: number; sources: number }[] = [];
  readonly #sources: FakeSourceNode[] = [];
  /** Page time minus device time, in milliseconds, and the output latency. */
  constructor(
    readonly offset: number,
    readonly latency = 40,
  ) {}

  createGain(): FakeGainNode {
    return new FakeGainNode(this);
  }

  createBuffer(channels: number, frames: number) {
    const planes = Array.from({ length: channels }, () => new Float32Array(frames));
    return { planes, copyToChannel: (plane: Float32Array, channel: number) => planes[channel].set(plane) };
  }

  createBufferSource(): FakeSourceNode {
    const source = new FakeSourceNode();
    this.#sources.push(source);
    return source;
  }

  getOutputTimestamp(): AudioTimestamp {
    const heard = this.currentTime - this.latency / 1000;
    return heard > 0
      ? { contextTime: heard, performanceTime: heard * 1000 + this.offset + this.latency }
      : { contextTime: 0, performanceTime: 0 };
  }

  /** Advance by `seconds` and play the first channel of all scheduled sources. */
  advance(seconds: number): void {
    const [from, to] = [this.currentTime, this.currentTime + seconds].map((time) => Math.round(time * 48_000));
    for (let frame = from; frame < to; frame++) {
      let sample = 0,
        sources = 0;
      for (const { buffer, begin, stopped, bus } of this.#sources) {
        const at = frame - begin * 48_000;
        const plane = buffer!.planes[0];
        if (stopped || at < 0 || at >= plane.length || frame / 48_000 > bus!.cut) continue;
        sample += plane[at];
        sources++;
      }
      this.output[frame] = { sample, sources };
    }
    this.currentTime = to / 48_000;
    for (const source of this.#sources) {
      const over = source.stopped || source.begin + source.buffer!.planes[0].length / 48_000 <= this.currentTime;
      if (!over || source.ended) continue;
      source.ended = true;
      source.dispatchEvent(new Event("ended"));
    }
    this.#sources.splice(0, this.#sources.length, ...this.#sources.filter(({ ended }) => !ended));
  }
}
