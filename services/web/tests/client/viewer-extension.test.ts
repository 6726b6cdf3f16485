/** Extensions of a stream's performers. */

import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Viewer } from "../../src/client/viewer";
import type { Message } from "../../src/wire/messages";
import { contactVectors } from "../golden-contacts";
import { extensionVectors, goldenDescription as goldenExtension } from "../golden-extensions";
import { type BlockVectors, goldenDescription } from "../golden-motion";
import { propVectors } from "../golden-props";
import { decodeBase64, loadVectors } from "../golden-vectors";
import { FakeWebSocket } from "./fake-websocket";

const EPOCH_US = 1_774_000_000_000_000;
const motionBlock = decodeBase64(loadVectors<BlockVectors>("blocks").valid[0].block);
const golden = extensionVectors();
const extensionBlock = decodeBase64(golden.valid[0].block);

let viewer: Viewer;

/** Return the golden extension for a performer; its frames need not be those of the motion. */
const extension = (performer = 0, change: object = {}) => ({
  ...goldenExtension(golden.tracks[0]),
  performer,
  ...change,
});
const description = (...extensions: ReturnType<typeof extension>[]): Message => ({
  name: "Description",
  motion: "dance",
  first: null,
  tracks: [goldenDescription(), ...extensions],
});
const data = (track: number, block: Uint8Array): Message => ({ name: "Data", track, rate: 1, index: 0, block });

function start(...messages: Message[]): void {
  FakeWebSocket.last.receive(
    { name: "ChannelHeader", motion: "dance", now: EPOCH_US, channels: 25, software: "0", version: 1, clock: "unix" },
    ...messages,
    {
      name: "TimelineState",
      epoch: 1,
      motion: "dance",
      clock: EPOCH_US,
      position: 0,
      playing: false,
      loop: true,
      duration: 2_600_000,
    },
  );
}

function connect(): Viewer {
  const connected = new Viewer({ url: "ws://stage/v1/motions/dance/stream", now: () => 0, solver: null });
  FakeWebSocket.last.accept();
  return connected;
}

beforeEach(() => {
  FakeWebSocket.install();
  viewer = connect();
});

afterEach(() => {
  viewer.close();
  FakeWebSocket.remove();
});

test("the stream is asked for extensions", () => {
  expect(new URL(FakeWebSocket.last.url).searchParams.get("extensions")).toBe("true");
});

test("a pose has the joints of the extension once their code is loaded, with blocks that came before", async () => {
  start(description(extension()), data(0, motionBlock), data(1, extensionBlock));
  await vi.waitFor(() => expect(viewer.poseAt(0)?.extended).toBeTruthy());
  const { extended } = viewer.poseAt(0) ?? {};
  expect(extended?.extraPositions.length).toBe(golden.tracks[0].names.length * 3);
  expect(extended?.extraPositions.every(Number.isFinite)).toBe(true);
  const withBlock = [...(extended?.extraOrientations ?? [])];
  const other = connect();
  start(description(extension()), data(0, motionBlock));
  await vi.waitFor(() => expect(other.poseAt(0)?.extended).toBeTruthy());
  expect([...(other.poseAt(0)?.extended?.extraOrientations ?? [])]).not.toEqual(withBlock);
  other.close();
});

test("a motion without extension, and one of an unknown codec, have plain poses", async () => {
  start(description(extension(0, { codec: "bunraku.extension/9" })), data(0, motionBlock), data(1, extensionBlock));
  await vi.dynamicImportSettled();
  expect(viewer.poseAt(0)).toBeTruthy();
  expect(viewer.poseAt(0)?.extended ?? null).toBeNull();
});

test("a damaged block of an extension is counted, and the pose stays", async () => {
  start(description(extension()), data(0, motionBlock));
  await vi.waitFor(() => expect(viewer.poseAt(0)?.extended).toBeTruthy());
  FakeWebSocket.last.receive(data(1, new Uint8Array(70_000)));
  expect(viewer.statistics().reason).toMatch(/could not be read/);
  expect(viewer.poseAt(0)?.extended).toBeTruthy();
});

test("a pose has the contacts of its feet, without those of a controlled leg", async () => {
  const { tracks, valid } = contactVectors();
  start({ ...description(), tracks: [goldenDescription(), tracks[0]] } as Message, data(0, motionBlock));
  FakeWebSocket.last.receive(data(1, decodeBase64(valid[0].block)));
  await vi.waitFor(() => expect(viewer.poseAt(0)?.contacts).toEqual({ planted: 3, controlled: 0, clock: EPOCH_US }));
  const limbs = new Map([[2, new Int16Array(9)]]);
  FakeWebSocket.last.receive({ name: "Overlay", sequence: 0, due: EPOCH_US, limbs, earlier: [] });
  expect(viewer.poseAt(0)?.contacts).toEqual({ planted: 2, controlled: 1, clock: EPOCH_US });
});

test("props of the motion are on the stage once their code is loaded", async () => {
  const props = propVectors();
  const { track, index, block } = props.valid[0];
  start(description(props.tracks[track] as ReturnType<typeof extension>), data(0, motionBlock));
  FakeWebSocket.last.receive({ name: "Data", track: 1, rate: 0, index, block: decodeBase64(block) });
  expect(viewer.poseAt(0)).not.toBeNull();
  const held = { prop: 9, kind: "later", limb: 13, place: [0, 0, 0] };
  await vi.waitFor(() => expect(viewer.propsAt(0)).toEqual([held]));
});

test("contacts of a motion without their track are not known", async () => {
  start(description(extension()), data(0, motionBlock), data(1, extensionBlock));
  await vi.waitFor(() => expect(viewer.poseAt(0)?.extended).toBeTruthy());
  expect(viewer.poseAt(0)?.contacts).toBeNull();
});

test("an extension that is described after contacts is added to them", async () => {
  const { tracks, valid } = contactVectors();
  const withContacts = { ...description(), tracks: [goldenDescription(), tracks[0]] } as Message;
  start(withContacts, data(0, motionBlock), data(1, decodeBase64(valid[0].block)));
  await vi.waitFor(() => expect(viewer.poseAt(0)?.contacts?.planted).toBe(3));
  expect(viewer.poseAt(0)?.extended).toBeNull();
  const withBoth = { ...description(), tracks: [goldenDescription(), tracks[0], extension()] } as Message;
  FakeWebSocket.last.receive(withBoth, data(2, extensionBlock));
  await vi.waitFor(() => expect(viewer.poseAt(0)?.extended).toBeTruthy());
  expect(viewer.poseAt(0)?.contacts?.planted).toBe(3);
  const plain = connect();
  start({ ...description(), tracks: [goldenDescription(), tracks[0], extension()] } as Message, data(0, motionBlock));
  await vi.waitFor(() => expect(plain.poseAt(0)?.extended).toBeTruthy());
  const orientations = (one: Viewer) => [...(one.poseAt(0)?.extended?.extraOrientations ?? [])];
  expect(orientations(plain)).not.toEqual(orientations(viewer));
  plain.close();
});
