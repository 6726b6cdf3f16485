import { Vector3 } from "three";
import { beforeEach, expect, test } from "vitest";
import type { LimbController } from "../../src/input/limb-controller";
import { createPointerInput, type PointerInput } from "../../src/input/pointer";
import { listenToPointer, showPointerState } from "../../src/input/pointer-events";
import type { Puppet } from "../../src/stage/puppet/puppet";
import type { Stage } from "../../src/stage/stage";
import { createStandingPuppet } from "../stage/puppet/figures";
import { createLimbController, FakePuppeteer } from "./fake-puppeteer";

const LEFT_HAND = 0;
/** Pixels per metre: the camera is far away along z. */
const SCALE = 200;

/** Minimal canvas for pointer events. */
class Canvas extends EventTarget {
  dataset: Record<string, string> = {};
  /** Position in the page, in pixels. */
  corner = { left: 0, top: 0 };
  setPointerCapture(): void {}
  toggleAttribute(name: string, on: boolean): void {
    if (on) this.dataset[name.replace("data-", "")] = "";
    else delete this.dataset[name.replace("data-", "")];
  }
  getBoundingClientRect(): { left: number; top: number } {
    return this.corner;
  }
}

let canvas: Canvas;
let limbController: LimbController;
let session: FakePuppeteer;
let pointer: PointerInput;
let puppet: Puppet;
let free: boolean;
let refused: number[];
let claimed: number[];
let performers: Puppet[];
let smoothing: number;
let depthInput: number;
/** Handles of the last drawn frame; null if every frame is drawn. */
let drawnHandles: ({ x: number; y: number } | null)[] | null;

beforeEach(() => {
  [canvas, session, puppet, free, refused, claimed, smoothing, depthInput] = [
    new Canvas(),
    new FakePuppeteer(),
    createStandingPuppet(),
    true,
    [],
    [],
    0,
    0,
  ];
  performers = [puppet];
  const toScreen = (at: Vector3) => ({ x: at.x * SCALE, y: -at.y * SCALE });
  drawnHandles = null;
  const stage = {
    performers,
    toScreen,
    get drawnHandles() {
      return (
        drawnHandles ??
        performers.flatMap((performer) =>
          [0, 1, 2, 3].map((limb) =>
            performer.group.visible ? toScreen(performer.handle(limb, new Vector3())) : null,
          ),
        )
      );
    },
    fromScreen: (x: number, y: number, through: Vector3) => new Vector3(x / SCALE, -y / SCALE, through.z),
    back: () => new Vector3(0, 0, 1),
    audience: { orbit: () => undefined },
  };
  limbController = createLimbController(performers, session);
  pointer = createPointerInput(stage as unknown as Stage, limbController, {
    canClaim: () => free,
    onRefused: (limb) => refused.push(limb),
    onClaimed: (limb) => claimed.push(limb),
    smoothing: () => smoothing,
    depthInput: () => depthInput,
  });
  const target = canvas as unknown as HTMLCanvasElement;
  listenToPointer(target, (message) => {
    pointer.handle(message);
    showPointerState(target, { isPointerNear: pointer.hoveredLimb !== null, isPulling: pointer.isDragging });
  });
});

function send(type: string, x: number, y: number, timeStamp: number): void {
  const event = Object.assign(new Event(type), {
    pointerId: 1,
    pointerType: "mouse",
    button: 0,
    clientX: x,
    clientY: y,
  });
  Object.defineProperty(event, "timeStamp", { value: timeStamp });
  canvas.dispatchEvent(event);
}

const ring = () => puppet.handle(LEFT_HAND, new Vector3());
const pullTarget = () => limbController.pullTarget(LEFT_HAND) as Vector3;

function grab(): { x: number; y: number } {
  const at = { x: ring().x * SCALE + 3, y: -ring().y * SCALE - 2 };
  send("pointerdown", at.x, at.y, 0);
  return at;
}

test("a handle follows the pointer that grabbed it, and is released with it", () => {
  const at = grab();
  expect([limbController.source(LEFT_HAND), claimed]).toEqual(["pointer", [LEFT_HAND]]);
  send("pointermove", at.x + 20, at.y - 40, 16);
  const expected = ring().add(new Vector3(0.1, 0.2, 0));
  expect(pullTarget().distanceTo(expected)).toBeLessThan(1e-9);
  pointer.update(32);
  expect(pullTarget().distanceTo(expected)).toBeLessThan(1e-9);
  expect(pointer.isDragging).toBe(true);
  send("pointerup", at.x + 20, at.y - 40, 48);
  expect(limbController.source(LEFT_HAND)).toBe(null);
  expect(pointer.isDragging).toBe(false);
});

test("the nearest visible handle of several performers is grabbed", () => {
  const second = createStandingPuppet();
  second.group.position.x = 1;
  second.handle = (limb, out) => puppet.handle(limb, out).add(second.group.position);
  performers.push(second);
  const at = { x: ring().x * SCALE + SCALE, y: -ring().y * SCALE };
  second.group.visible = false;
  send("pointerdown", at.x, at.y, 0);
  expect(claimed).toEqual([]);
  send("pointerup", at.x, at.y, 0);
  second.group.visible = true;
  send("pointerdown", at.x, at.y, 0);
  expect([claimed, session.calls[0]]).toEqual([[4 + LEFT_HAND], ["claim", 4 + LEFT_HAND]]);
  send("pointermove", at.x + 20, at.y, 16);
  expect(limbController.pullTarget(4 + LEFT_HAND)?.x).toBeCloseTo(ring().x + 1.1, 9);
  expect(limbController.pullTarget(LEFT_HAND)).toBe(null);
});

test("the handle under the pointer in the drawn picture is grabbed, although it has moved since", () => {
  const drawn = { x: ring().x * SCALE, y: -ring().y * SCALE };
  drawnHandles = [drawn, null, null, null];
  puppet.group.position.x += 3;
  puppet.group.updateMatrixWorld(true);
  const moved = ring();
  expect(Math.abs(moved.x * SCALE - drawn.x)).toBeGreaterThan(100);
  send("pointerdown", drawn.x, drawn.y, 0);
  expect(claimed).toEqual([LEFT_HAND]);
  // the limb is pulled by the movement of the pointer, not to it
  send("pointermove", drawn.x + 20, drawn.y, 16);
  expect(pullTarget().distanceTo(moved.add(new Vector3(0.1, 0, 0)))).toBeLessThan(1e-9);
});

test("a limb that moves under a resting pointer is hovered, and no longer when it has left", () => {
  const at = { x: ring().x * SCALE, y: -ring().y * SCALE };
  drawnHandles = [{ x: at.x + 100, y: at.y }];
  send("pointermove", at.x, at.y, 0);
  expect(pointer.hoveredLimb).toBe(null);
  drawnHandles = [at];
  expect(pointer.hoveredLimb).toBe(LEFT_HAND);
  // a dragged limb stays hovered, although it may not reach the pointer
  send("pointerdown", at.x, at.y, 16);
  send("pointermove", at.x + 300, at.y, 32);
  expect(pointer.hoveredLimb).toBe(LEFT_HAND);
  send("pointerup", at.x + 300, at.y, 48);
  expect(pointer.hoveredLimb).toBe(null);
  // nothing is hovered while the view turns under the pointer
  send("pointerdown", at.x + 300, at.y, 64);
  send("pointermove", at.x, at.y, 80);
  expect(pointer.hoveredLimb).toBe(null);
  send("pointerup", at.x, at.y, 96);
  expect(pointer.hoveredLimb).toBe(LEFT_HAND);
  send("pointerleave", at.x, at.y, 112);
  expect(pointer.hoveredLimb).toBe(null);
});

test("a drag beside all handles of the drawn picture turns the view", () => {
  drawnHandles = [];
  grab();
  expect(claimed).toEqual([]);
});

test("a handle that cannot be claimed is refused", () => {
  free = false;
  grab();
  expect([refused, limbController.source(LEFT_HAND)]).toEqual([[LEFT_HAND], null]);
  send("pointerdown", 5000, 5000, 10);
  expect(refused).toEqual([LEFT_HAND]);
});

test("the canvas may be anywhere in the page", () => {
  canvas.corner = { left: 300, top: 1200 };
  const [x, y] = [ring().x * SCALE + 300, -ring().y * SCALE + 1200];
  send("pointermove", x, y, 0);
  expect(pointer.hoveredLimb).toBe(LEFT_HAND);
  send("pointerdown", x, y, 0);
  send("pointermove", x + 50, y - 30, 16);
  expect(pullTarget().x).toBeCloseTo(ring().x + 50 / SCALE, 9);
  expect(pullTarget().y).toBeCloseTo(ring().y + 30 / SCALE, 9);
});

test("a trembling pointer is smoothed by the chosen amount and converges", () => {
  const spread = (amount: number) => {
    smoothing = amount;
    const at = grab();
    const seen: number[] = [];
    for (let i = 1; i <= 120; i++) {
      send("pointermove", at.x + (i % 2) * 4, at.y, i * 16);
      seen.push(pullTarget().x);
    }
    for (let i = 121; i <= 240; i++) {
      send("pointermove", at.x + 60, at.y, i * 16);
      pointer.update(i * 16 + 8);
    }
    expect(pullTarget().x).toBeCloseTo(ring().x + 60 / SCALE, 4);
    send("pointerup", at.x, at.y, 4000);
    const steady = seen.slice(60);
    return Math.max(...steady) - Math.min(...steady);
  };
  expect(spread(0)).toBeCloseTo(4 / SCALE, 9);
  expect(spread(1)).toBeLessThan(1 / SCALE);
});

test("keys and wheel move the depth of a pull within what the limb follows", () => {
  grab();
  const depth = ring().z;
  depthInput = 1;
  pointer.update(100);
  expect(pullTarget().z - depth).toBeCloseTo(0.07, 9);
  pointer.update(150);
  expect(pullTarget().z - depth).toBeCloseTo(0.105, 9);
  for (let now = 150; now < 2000; now += 16) pointer.update(now);
  expect(pullTarget().z - depth).toBeCloseTo(0.15, 9);
  depthInput = 0;
  pointer.update(2016);
  expect(pullTarget().z).toBeCloseTo(depth, 9);
});

test("a handle that follows a frame later does not jump between two depths", () => {
  const at = grab();
  const depths: number[] = [];
  for (let frame = 1; frame <= 40; frame++) {
    // The handle is where the target was in the frame before; a jolt has moved it once.
    const target = pullTarget()?.clone() ?? ring();
    pointer.update(frame * 100);
    depths.push(pullTarget().z);
    puppet.group.position.z += target.z - ring().z + (frame === 1 ? 0.08 : 0);
    puppet.group.updateMatrixWorld(true);
  }
  const [last, previous] = depths.slice(-2);
  expect(at.x).toBeGreaterThan(0);
  expect(Math.abs(last - previous)).toBeLessThan(1e-6);
});
