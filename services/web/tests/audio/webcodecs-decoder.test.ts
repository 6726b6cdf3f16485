import { afterEach, describe, expect, test, vi } from "vitest";
import { findWebCodecsDecoder } from "../../src/audio/webcodecs-decoder";

/** Fake AudioDecoder that emits its output when the test asks. */
class FakeAudioDecoder {
  static made: FakeAudioDecoder[] = [];
  static able = true;
  static isConfigSupported = async () => ({ supported: FakeAudioDecoder.able });
  state = "unconfigured";
  readonly given: { timestamp: number; duration: number; type: string }[] = [];
  constructor(readonly init: { output(data: unknown): void; error(error: Error): void }) {
    FakeAudioDecoder.made.push(this);
  }
  configure(): void {
    this.state = "configured";
  }
  decode(chunk: { timestamp: number; duration: number; type: string }): void {
    this.given.push(chunk);
  }
  flush = async () => undefined;
  close(): void {
    this.state = "closed";
  }
  /** Emit the first chunk with this many channels. */
  put(channels = 2): void {
    const { timestamp } = this.given.shift()!;
    const copyTo = (plane: Float32Array, { planeIndex }: { planeIndex: number }) => plane.fill(planeIndex + 1);
    this.init.output({ timestamp, numberOfFrames: 2_880, numberOfChannels: channels, copyTo, close: () => undefined });
  }
}

function install(able = true): void {
  FakeAudioDecoder.made = [];
  FakeAudioDecoder.able = able;
  vi.stubGlobal("AudioDecoder", FakeAudioDecoder);
  vi.stubGlobal(
    "EncodedAudioChunk",
    class {
      constructor(chunk: object) {
        Object.assign(this, chunk);
      }
    },
  );
}

afterEach(() => void vi.unstubAllGlobals());

test("is not available without AudioDecoder or without Opus", async () => {
  expect(await findWebCodecsDecoder(2)).toBeNull();
  install(false);
  expect(await findWebCodecsDecoder(2)).toBeNull();
});

describe("packets", () => {
  test("are emitted by number, with a plane per channel even if fewer arrive", async () => {
    install();
    const out: [number, number[]][] = [];
    const decoder = (await findWebCodecsDecoder(2))!((number, planes) =>
      out.push([number, planes!.map(([first]) => first)]),
    );
    decoder.decode(40, Uint8Array.of(1));
    decoder.decode(41, Uint8Array.of(2));
    const [fake] = FakeAudioDecoder.made;
    expect(fake.given.map(({ timestamp, duration, type }) => [timestamp, duration, type])).toEqual([
      [2_400_000, 60_000, "key"],
      [2_460_000, 60_000, "key"],
    ]);
    fake.put();
    fake.put(1);
    expect(out).toEqual([
      [40, [1, 2]],
      [41, [1, 1]],
    ]);
    decoder.close();
    await expect.poll(() => fake.state).toBe("closed");
  });

  test("a failed one is reported as such, and no other", async () => {
    install();
    vi.spyOn(console, "warn").mockReturnValue();
    const out: [number, unknown][] = [];
    const decoder = (await findWebCodecsDecoder(1))!((number, planes) => out.push([number, planes]));
    decoder.decode(0, Uint8Array.of(1));
    decoder.decode(1, Uint8Array.of(1));
    const [fake] = FakeAudioDecoder.made;
    fake.close();
    fake.init.error(new Error("no Opus"));
    decoder.decode(2, Uint8Array.of(1));
    expect(out).toEqual([
      [0, null],
      [2, null],
    ]);
    expect(() => decoder.close()).not.toThrow();
    vi.restoreAllMocks();
  });
});
