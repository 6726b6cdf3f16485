import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import { SoundController, type SoundState } from "../../src/app/sound-controller";
import { browserSoundPreference, type SoundPreference } from "../../src/audio/preference";
import type { Viewer } from "../../src/client/viewer";
import { stubStorage } from "../storage/storage-stub";

const { players, speakers } = vi.hoisted(() => ({
  players: [] as { store: unknown; retimed: number; closed: boolean }[],
  speakers: [] as { allowed: boolean; heard: boolean; closed: boolean; volume: number; changed: () => void }[],
}));
/** When a decoder is found. */
let found: Promise<unknown>;

/** What is heard through: the browser's audio, and the player that is tested by itself. */
vi.mock("../../src/audio/sound", () => ({
  findDecoder: () => found,
  AudioPlayer: class {
    closed = false;
    retimed = 0;
    readonly store: unknown;
    constructor(_context: unknown, _output: unknown, played: { store: unknown }) {
      this.store = played.store;
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

class Watched extends EventTarget {
  sound: { track: { channels: number } } | null = null;
  lead: ((now: number) => unknown) | null = null;
  /** Another motion comes on, with sound or without. */
  show(sound: boolean): Promise<unknown> {
    this.sound = sound ? { track: { channels: 2 } } : null;
    this.dispatchEvent(new Event("figure"));
    return new Promise((done) => setTimeout(done));
  }
}

let page: EventTarget;
let viewer: Watched;
let listening: SoundController;
let states: SoundState[];
const button = {} as Element;

beforeEach(() => {
  players.length = speakers.length = 0;
  page = new EventTarget();
  vi.stubGlobal("addEventListener", page.addEventListener.bind(page));
  vi.stubGlobal("KeyboardEvent", class {});
  stubStorage("localStorage");
  found = Promise.resolve(() => undefined);
  states = [];
  start();
});
afterEach(() => void vi.unstubAllGlobals());

function start(memory = browserSoundPreference): void {
  viewer = new Watched();
  listening = new SoundController((state) => states.push(state), button, memory);
  listening.setViewer(viewer as unknown as Viewer);
}

/** A gesture of the person, which the browser lets the page be heard after. */
function gesture(): void {
  if (speakers[0]) speakers[0].allowed = true;
  page.dispatchEvent(new Event("keydown"));
}

test("without sound nothing is fetched and nothing shown", async () => {
  await viewer.show(false);
  gesture();
  expect([players.length, speakers.length, viewer.lead]).toEqual([0, 0, null]);
  expect(states.every(({ there }) => !there)).toBe(true);
});

describe("with sound", () => {
  beforeEach(() => viewer.show(true));

  test("it is there, and heard from the first gesture on; the stage follows it, and edits reach it", async () => {
    expect(states.at(-1)).toEqual({ there: true, heard: false, volume: 0.8 });
    gesture();
    expect(states.at(-1)).toEqual({ there: true, heard: true, volume: 0.8 });
    expect(viewer.lead?.(5)).toEqual({ time: 5, run: 1 });
    viewer.dispatchEvent(new Event("timeline"));
    expect(players[0].retimed).toBe(1);
  });

  test("a first key that means sound on does not switch it off again; the next one does, and that is remembered", async () => {
    gesture();
    listening.toggle();
    expect(speakers[0].heard).toBe(true);
    await new Promise((done) => setTimeout(done));
    gesture();
    listening.toggle();
    expect(states.at(-1)?.heard).toBe(false);
    gesture();
    expect(states.at(-1)?.heard).toBe(false);
    start();
    await viewer.show(true);
    gesture();
    // nothing is opened that is not wanted
    expect(speakers).toHaveLength(1);
    listening.toggle();
    speakers[1].allowed = true;
    page.dispatchEvent(new Event("click"));
    expect(speakers[1].heard).toBe(true);
  });

  test("a press of its button is no such gesture: it says what it wants itself", () => {
    speakers[0].allowed = true;
    page.dispatchEvent(Object.assign(new Event("click"), { composedPath: () => [button, page] }));
    expect(speakers[0].heard).toBe(false);
    listening.toggle();
    expect(speakers[0].heard).toBe(true);
    listening.toggle();
    expect(speakers[0].heard).toBe(false);
  });

  test("how loud is told at once, and who tells it wants to hear", () => {
    speakers[0].allowed = true;
    listening.toggle();
    listening.toggle();
    expect(speakers[0].heard).toBe(false);
    listening.volume = 0.25;
    expect([speakers[0].volume, speakers[0].heard, states.at(-1)]).toEqual([
      0.25,
      true,
      { there: true, heard: true, volume: 0.25 },
    ]);
  });

  test("another motion's takes its place, on the same device; one without is silence", async () => {
    gesture();
    await viewer.show(true);
    expect(players.map(({ closed }) => closed)).toEqual([true, false]);
    expect(speakers).toHaveLength(1);
    await viewer.show(false);
    expect(players.map(({ closed }) => closed)).toEqual([true, true]);
    expect([viewer.lead, speakers[0].heard, states.at(-1)?.there]).toEqual([null, false, false]);
    await viewer.show(true);
    expect(speakers[0].heard).toBe(true);
  });

  test("of two that come on at once the later is played", async () => {
    void viewer.show(true);
    await viewer.show(true);
    expect(players.filter(({ closed }) => !closed).map(({ store }) => store)).toEqual([viewer.sound]);
  });
});

describe("where it is not wanted at first", () => {
  let remembered: SoundPreference;

  beforeEach(() => {
    remembered = { on: false, volume: 0.5 };
    start({ load: () => remembered, save: (preference) => void (remembered = preference) });
    return viewer.show(true);
  });

  test("nothing is opened or heard, whatever is pressed", () => {
    gesture();
    expect([players.length, speakers.length, viewer.lead, states.at(-1)]).toEqual([
      0,
      0,
      null,
      { there: true, heard: false, volume: 0.5 },
    ]);
  });

  test("the device is opened within the gesture that asks for it, though what plays comes later", async () => {
    listening.toggle();
    expect([speakers.length, players.length, remembered.on]).toEqual([1, 0, true]);
    gesture();
    await new Promise((done) => setTimeout(done));
    expect([players.length, speakers[0].heard, speakers[0].volume]).toEqual([1, true, 0.5]);
    listening.setPreference({ on: true, volume: 1 });
    listening.setPreference({ on: true, volume: 0.25 });
    expect([speakers.length, players.length, speakers[0].volume]).toEqual([1, 1, 0.25]);
  });

  test("asked for twice before it is there, it is played once", async () => {
    listening.setPreference({ on: true, volume: 1 });
    listening.setPreference({ on: true, volume: 0.5 });
    await new Promise((done) => setTimeout(done));
    expect([speakers.length, players.length]).toEqual([1, 1]);
  });

  test("what could not be loaded is not said to be heard", async () => {
    const warned = vi.spyOn(console, "warn").mockImplementation(() => undefined);
    found = Promise.reject(new Error("no line"));
    listening.toggle();
    gesture();
    await new Promise((done) => setTimeout(done));
    expect([players.length, speakers[0].heard, warned.mock.calls.length]).toEqual([0, false, 1]);
    warned.mockRestore();
  });

  test("closed it is silent, gives the device back, and hears no gesture", async () => {
    listening.toggle();
    gesture();
    await new Promise((done) => setTimeout(done));
    listening.close();
    gesture();
    expect([players[0].closed, speakers[0].heard, speakers[0].closed, states.at(-1)?.there]).toEqual([
      true,
      false,
      true,
      false,
    ]);
  });
});
