import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import { SoundController, type SoundSource, type SoundState } from "../../src/app/sound-controller";
import { browserSoundPreference, type SoundPreference, type SoundPreferenceStore } from "../../src/audio/preference";
import { stubStorage } from "../storage/storage-stub";

const { players, speakers } = vi.hoisted(() => ({
  players: [] as { store: unknown; retimed: number; closed: boolean }[],
  speakers: [] as { allowed: boolean; heard: boolean; closed: boolean; volume: number; changed: () => void }[],
}));
/** Resolves when the decoder was found. */
let decoder: Promise<unknown>;

// The browser's audio output and the player are replaced; the player has its own tests.
vi.mock("../../src/audio/sound", () => ({
  findDecoder: () => decoder,
  AudioPlayer: class {
    closed = false;
    retimed = 0;
    readonly store: unknown;
    constructor(_context: unknown, _output: unknown, source: { store: unknown }) {
      this.store = source.store;
      players.push(this);
    }
    leadAt = (now: number) => ({ time: now, run: players.length });
    retime = () => void this.retimed++;
    close = () => void (this.closed = true);
  },
}));
vi.mock("../../src/audio/speaker", () => ({
  Speaker: class {
    allowed = false;
    heard = false;
    closed = false;
    volume = 0;
    constructor(readonly changed: () => void) {
      speakers.push(this);
    }
    resume(): void {
      this.set(this.allowed);
    }
    suspend(): void {
      this.set(false);
    }
    close(): void {
      this.closed = true;
    }
    private set(heard: boolean): void {
      this.heard = heard;
      this.changed();
    }
  },
}));

class FakeViewer extends EventTarget {
  audio: { track: { channels: number } } | null = null;
  leader: ((now: number) => unknown) | null = null;
  /** Switch to another motion, with or without sound. */
  showMotion(hasSound: boolean): Promise<unknown> {
    this.audio = hasSound ? { track: { channels: 2 } } : null;
    this.dispatchEvent(new Event("figure"));
    return nextTask();
  }
}

function nextTask(): Promise<unknown> {
  return new Promise((resolve) => setTimeout(resolve));
}

let page: EventTarget;
let viewer: FakeViewer;
let controller: SoundController;
let states: SoundState[];
const button = {} as Element;

beforeEach(() => {
  players.length = speakers.length = 0;
  page = new EventTarget();
  vi.stubGlobal("addEventListener", page.addEventListener.bind(page));
  vi.stubGlobal("KeyboardEvent", class {});
  stubStorage("localStorage");
  decoder = Promise.resolve(() => undefined);
  states = [];
  createController();
});
afterEach(() => void vi.unstubAllGlobals());

function createController(
  preferenceStore: SoundPreferenceStore = browserSoundPreference,
  onSilence: () => void = () => undefined,
): void {
  viewer = new FakeViewer();
  controller = new SoundController((state) => states.push(state), button, preferenceStore, onSilence);
  controller.setViewer(viewer as unknown as SoundSource);
}

/** Dispatch a user gesture, after which the browser allows sound. */
function dispatchGesture(): void {
  if (speakers[0]) speakers[0].allowed = true;
  page.dispatchEvent(new Event("keydown"));
}

test("motion without sound loads nothing and hides the button", async () => {
  await viewer.showMotion(false);
  dispatchGesture();
  expect([players.length, speakers.length, viewer.leader]).toEqual([0, 0, null]);
  expect(states.every(({ available }) => !available)).toBe(true);
});

describe("motion with sound", () => {
  beforeEach(() => viewer.showMotion(true));

  test("first gesture starts the sound, which then leads the stage's clock", async () => {
    expect(states.at(-1)).toEqual({ available: true, audible: false, volume: 0.8 });
    dispatchGesture();
    expect(states.at(-1)).toEqual({ available: true, audible: true, volume: 0.8 });
    expect(viewer.leader?.(5)).toEqual({ time: 5, run: 1 });
    viewer.dispatchEvent(new Event("timeline"));
    expect(players[0].retimed).toBe(1);
  });

  test("first sound key does not switch the sound off; the second does, and is stored", async () => {
    dispatchGesture();
    controller.toggle();
    expect(speakers[0].heard).toBe(true);
    await nextTask();
    dispatchGesture();
    controller.toggle();
    expect(states.at(-1)?.audible).toBe(false);
    dispatchGesture();
    expect(states.at(-1)?.audible).toBe(false);
    createController();
    await viewer.showMotion(true);
    dispatchGesture();
    // no audio device is opened for unwanted sound
    expect(speakers).toHaveLength(1);
    controller.toggle();
    speakers[1].allowed = true;
    page.dispatchEvent(new Event("click"));
    expect(speakers[1].heard).toBe(true);
  });

  test("a browser that plays no sound after a gesture is reported once", async () => {
    vi.useFakeTimers();
    let reports = 0;
    controller = new SoundController(
      (state) => states.push(state),
      button,
      browserSoundPreference,
      () => reports++,
    );
    const opened = speakers.length;
    controller.setViewer(viewer as unknown as SoundSource);
    vi.advanceTimersByTime(60_000);
    // Without a gesture every browser is silent.
    expect([speakers.length - opened, reports]).toEqual([1, 0]);
    for (let press = 0; press < 3; press++) {
      page.dispatchEvent(new Event("keydown"));
      vi.advanceTimersByTime(10_000);
    }
    expect(reports).toBe(1);
    vi.useRealTimers();
  });

  test("press of the sound button does not count as a gesture", () => {
    speakers[0].allowed = true;
    page.dispatchEvent(Object.assign(new Event("click"), { composedPath: () => [button, page] }));
    expect(speakers[0].heard).toBe(false);
    controller.toggle();
    expect(speakers[0].heard).toBe(true);
    controller.toggle();
    expect(speakers[0].heard).toBe(false);
  });

  test("setting the volume applies at once and switches the sound on", () => {
    speakers[0].allowed = true;
    controller.toggle();
    controller.toggle();
    expect(speakers[0].heard).toBe(false);
    controller.volume = 0.25;
    expect([speakers[0].volume, speakers[0].heard, states.at(-1)]).toEqual([
      0.25,
      true,
      { available: true, audible: true, volume: 0.25 },
    ]);
  });

  test("next motion's sound uses the same device; a silent motion stops it", async () => {
    dispatchGesture();
    await viewer.showMotion(true);
    expect(players.map(({ closed }) => closed)).toEqual([true, false]);
    expect(speakers).toHaveLength(1);
    await viewer.showMotion(false);
    expect(players.map(({ closed }) => closed)).toEqual([true, true]);
    expect([viewer.leader, speakers[0].heard, states.at(-1)?.available]).toEqual([null, false, false]);
    await viewer.showMotion(true);
    expect(speakers[0].heard).toBe(true);
  });

  test("of two motions at once only the later one is played", async () => {
    void viewer.showMotion(true);
    await viewer.showMotion(true);
    expect(players.filter(({ closed }) => !closed).map(({ store }) => store)).toEqual([viewer.audio]);
  });
});

describe("sound switched off by preference", () => {
  let stored: SoundPreference;

  beforeEach(() => {
    stored = { on: false, volume: 0.5 };
    createController({ load: () => stored, save: (preference) => void (stored = preference) });
    return viewer.showMotion(true);
  });

  test("gesture opens no device and plays nothing", () => {
    dispatchGesture();
    expect([players.length, speakers.length, viewer.leader, states.at(-1)]).toEqual([
      0,
      0,
      null,
      { available: true, audible: false, volume: 0.5 },
    ]);
  });

  test("device is opened within the gesture, before the player is loaded", async () => {
    controller.toggle();
    expect([speakers.length, players.length, stored.on]).toEqual([1, 0, true]);
    dispatchGesture();
    await nextTask();
    expect([players.length, speakers[0].heard, speakers[0].volume]).toEqual([1, true, 0.5]);
    controller.setPreference({ on: true, volume: 1 });
    controller.setPreference({ on: true, volume: 0.25 });
    expect([speakers.length, players.length, speakers[0].volume]).toEqual([1, 1, 0.25]);
  });

  test("switching on twice while loading creates one player", async () => {
    controller.setPreference({ on: true, volume: 1 });
    controller.setPreference({ on: true, volume: 0.5 });
    await nextTask();
    expect([speakers.length, players.length]).toEqual([1, 1]);
  });

  test("sound that cannot be loaded is not shown as audible, and reported once", async () => {
    const warn = vi.spyOn(console, "warn").mockImplementation(() => undefined);
    const reports: string[] = [];
    createController({ load: () => stored, save: () => undefined }, () => reports.push("no sound"));
    await viewer.showMotion(true);
    decoder = Promise.reject(new Error("not loaded"));
    controller.toggle();
    dispatchGesture();
    await nextTask();
    expect([players.length, speakers[0].heard, warn.mock.calls.length]).toEqual([0, false, 1]);
    await viewer.showMotion(true);
    expect([warn.mock.calls.length, reports]).toEqual([2, ["no sound"]]);
    warn.mockRestore();
  });

  test("close stops the sound, frees the device and ignores gestures", async () => {
    controller.toggle();
    dispatchGesture();
    await nextTask();
    controller.close();
    dispatchGesture();
    expect([players[0].closed, speakers[0].heard, speakers[0].closed, states.at(-1)?.available]).toEqual([
      true,
      false,
      true,
      false,
    ]);
  });
});
