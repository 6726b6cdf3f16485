import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { GamepadPolling } from "../../src/app/gamepad-polling";
import { type AnimationFrames, stubAnimationFrames } from "./animation-frames";

const PAD = { id: "pad" } as Gamepad;

let frames: AnimationFrames;
let gamepad: { pad: Gamepad | null; update(now: number, enabled?: boolean): void };
let dialog: { isOpen: boolean; isCapturing: boolean; updateGamepad(pad: unknown): void };
let updates: (boolean | undefined)[];
let shown: unknown[];
let polling: GamepadPolling;

beforeEach(() => {
  frames = stubAnimationFrames();
  [updates, shown] = [[], []];
  gamepad = { pad: null, update: (_, enabled) => void updates.push(enabled) };
  dialog = { isOpen: false, isCapturing: false, updateGamepad: (pad) => void shown.push(pad) };
  polling = new GamepadPolling(gamepad, dialog);
});
afterEach(() => void vi.unstubAllGlobals());

test("without a gamepad no frame is requested", () => {
  polling.start();
  expect([updates, frames.pending]).toEqual([[true], 0]);
});

test("a gamepad is polled once per frame until it is disconnected", () => {
  gamepad.pad = PAD;
  polling.start();
  polling.start();
  frames.run();
  frames.run();
  expect([updates.length, frames.pending]).toEqual([3, 1]);
  gamepad.pad = null;
  frames.run();
  expect(frames.pending).toBe(0);
  gamepad.pad = PAD;
  polling.start();
  expect(frames.pending).toBe(1);
});

test("an open dialog shows the gamepad, and commands pause while it captures a button", () => {
  dialog.isOpen = true;
  polling.start();
  gamepad.pad = PAD;
  dialog.isCapturing = true;
  frames.run();
  expect([updates, shown]).toEqual([
    [true, false],
    [null, PAD],
  ]);
  gamepad.pad = null;
  dialog.isOpen = dialog.isCapturing = false;
  frames.run();
  expect([shown.length, frames.pending]).toEqual([2, 0]);
});
