import { afterEach, describe, expect, test, vi } from "vitest";
import { findWebCodecsDecoder } from "../../src/audio/webcodecs-decoder";

/** A browser's decoder in a test's hands: what is given to it comes out when the test says. */
class Decoder {
  static made: Decoder[] = [];
  static able = true;
  static isConfigSupported = async () => ({ supported: Decoder.able });
  state = "unconfigured";
  readonly given: { timestamp: number; duration: number; type: string }[] = [];
  constructor(readonly init: { output(data: unknown): void; error(error: Error): void }) {
    Decoder.made.push(this);
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
  /** The chunk given first comes out, of so many channels. */
  put(channels = 2): void {
    const { timestamp } = this.given.shift()!;
    const copyTo = (plane: Float32Array, { planeIndex }: { planeIndex: number }) => plane.fill(planeIndex + 1);
    this.init.output({ timestamp, numberOfFrames: 2_880, numberOfChannels: channels, copyTo, close: () => undefined });
  }
}

function install(able = true): void {
  Decoder.made = [];
  Decoder.able = able;
  vi.stubGlobal("AudioDecoder", Decoder);
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

test("a browser that has none, or that cannot Opus, has no such decoder", async () => {
  expect(await findWebCodecsDecoder(2)).toBeNull();
  install(false);
  expect(await findWebCodecsDecoder(2)).toBeNull();
});

describe("packets", () => {
  test("are told by their numbers, a plane for each channel, though fewer should come", async () => {
    install();
    const out: [number, number[]][] = [];
    const decoder = (await findWebCodecsDecoder(2))!((number, planes) =>
      out.push([number, planes!.map(([first]) => first)]),
    );
    decoder.decode(40, Uint8Array.of(1));
    decoder.decode(41, Uint8Array.of(2));
    const [inside] = Decoder.made;
    expect(inside.given.map(({ timestamp, duration, type }) => [timestamp, duration, type])).toEqual([
      [2_400_000, 60_000, "key"],
      [2_460_000, 60_000, "key"],
    ]);
    inside.put();
    inside.put(1);
    expect(out).toEqual([
      [40, [1, 2]],
      [41, [1, 1]],
    ]);
    decoder.close();
    await expect.poll(() => inside.state).toBe("closed");
  });

  test("it fails at one: that is told as such, and no other", async () => {
    install();
    vi.spyOn(console, "warn").mockReturnValue();
    const out: [number, unknown][] = [];
    const decoder = (await findWebCodecsDecoder(1))!((number, planes) => out.push([number, planes]));
    decoder.decode(0, Uint8Array.of(1));
    decoder.decode(1, Uint8Array.of(1));
    const [inside] = Decoder.made;
    inside.close();
    inside.init.error(new Error("no Opus"));
    decoder.decode(2, Uint8Array.of(1));
    expect(out).toEqual([
      [0, null],
      [2, null],
    ]);
    expect(() => decoder.close()).not.toThrow();
    vi.restoreAllMocks();
  });
});
