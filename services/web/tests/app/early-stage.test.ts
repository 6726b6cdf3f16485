import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { StartupSequence } from "../../src/app/startup";
import type { EngineCommand, EngineEvent } from "../../src/engine/message";

const OPTIONS = { server: "", token: null, language: "en", timeOrigin: 0, bestQuality: false, view: null } as const;
const READY: EngineEvent = { type: "ready" };
const DRAWN: EngineEvent = { type: "frame", changes: { hasDrawnPerformer: true }, playback: 1, time: null };

let sessions: { id: string; viewers: number }[] | null;
let prefersReducedMotion: boolean;
const root = { dataset: {} as Record<string, string> };

beforeEach(() => {
  vi.useFakeTimers();
  [sessions, prefersReducedMotion] = [[{ id: "running", viewers: 0 }], false];
  vi.stubGlobal("matchMedia", (query: string) => ({ matches: prefersReducedMotion && query.includes("motion") }));
  vi.stubGlobal("document", { hidden: false, documentElement: root });
  for (const name of ["innerWidth", "innerHeight", "devicePixelRatio"]) vi.stubGlobal(name, 1);
  vi.stubGlobal("fetch", async () =>
    sessions ? Response.json({ items: sessions, next: null }) : Response.json({ title: "No" }, { status: 401 }),
  );
});
afterEach(() => {
  vi.unstubAllGlobals();
  vi.useRealTimers();
});

async function startStage(query = "") {
  const { EarlyStage } = await import("../../src/app/early-stage");
  const commands: EngineCommand[] = [];
  const worker = {
    postMessage: (command: EngineCommand) => void commands.push(command),
    onmessage: null as ((event: { data: EngineEvent }) => void) | null,
  };
  const canvas = { transferControlToOffscreen: () => "offscreen" } as unknown as HTMLCanvasElement;
  const startup = new StartupSequence(root as unknown as HTMLElement);
  const due: string[] = [];
  void startup.loadDue.then(() => due.push("load"));
  void startup.buildDue.then(() => due.push("build"));
  const stage = new EarlyStage(canvas, new URLSearchParams(query), OPTIONS, startup);
  await stage.start(Promise.resolve(worker as unknown as Worker));
  await stage.entered;
  const findCommand = (type: string) => commands.find((command) => command.type === type);
  return { findCommand, due, send: (data: EngineEvent) => worker.onmessage?.({ data }), stage };
}

test("the running session is entered before the page loads", async () => {
  const { due, findCommand, stage } = await startStage();
  expect(stage.opened).toMatchObject({ number: 1, id: "running", kind: "sessions" });
  expect(findCommand("open")).toEqual({ type: "open", playback: stage.opened });
  expect(findCommand("set")).toMatchObject({ settings: { theme: "night", viewport: { sideInsets: [96, 96] } } });
  expect(findCommand("edit")).toBeUndefined();
  expect(due).toEqual([]);
});

test("the session or motion that the address names is entered", async () => {
  expect((await startStage("session=a&motion=b")).stage.opened).toMatchObject({ id: "a", kind: "sessions" });
  expect((await startStage("motion=b")).stage.opened).toMatchObject({ id: "b", kind: "motions" });
});

test("a session without viewers starts paused for those who prefer less motion", async () => {
  prefersReducedMotion = true;
  expect((await startStage()).findCommand("edit")).toEqual({ type: "edit", change: { playing: false } });
});

test("without a session, or if it is not found, the page loads at once and has to enter one", async () => {
  for (sessions of [[], null]) {
    const { due, stage } = await startStage();
    expect([await stage.entered, stage.opened]).toEqual([null, null]);
    expect(due).toEqual(["load", "build"]);
  }
});

test("the page receives the events that came before it, then the later ones, in order", async () => {
  const { send, stage } = await startStage();
  const received: EngineEvent[] = [];
  send(READY);
  send(DRAWN);
  stage.listen((event) => received.push(event));
  expect(received).toEqual([READY, DRAWN]);
  send({ type: "graphics", isLost: true });
  expect(received.at(-1)).toEqual({ type: "graphics", isLost: true });
});

test("loaded scripts of the stage load the page, and the first frame ends the startup without it", async () => {
  const { due, send } = await startStage();
  send({ type: "loaded" });
  await vi.advanceTimersByTimeAsync(0);
  expect([due, root.dataset["arriving"]]).toEqual([["load"], "veiled"]);
  send(DRAWN);
  await vi.advanceTimersByTimeAsync(0);
  expect(due).toEqual(["load", "build"]);
  expect(root.dataset["arriving"]).toBeUndefined();
});
