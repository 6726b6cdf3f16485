import { Matrix4, Quaternion, Vector3 } from "three";
import { beforeEach, describe, expect, test, vi } from "vitest";
import type { Playback } from "../../src/engine/playback";
import { moveNearestProp, placeBefore, putProp } from "../../src/engine/prop-request";
import type { PropPresence } from "../../src/wire/messages";

class FakeViewer extends EventTarget {
  presence: { props: PropPresence[] | null } = { props: null };

  show(...props: PropPresence[]): void {
    this.presence = { props };
    this.dispatchEvent(new Event("presence"));
  }
}

class FakePuppeteer extends EventTarget {
  isConnected = true;
  readonly sent: unknown[] = [];

  put(...request: unknown[]): boolean {
    if (this.isConnected) this.sent.push(request);
    return this.isConnected;
  }

  refuse(prop: number, reason: string): void {
    this.dispatchEvent(new CustomEvent("prop refusal", { detail: { prop, reason } }));
  }
}

let viewer: FakeViewer;
let puppeteer: FakePuppeteer;

beforeEach(() => {
  [viewer, puppeteer] = [new FakeViewer(), new FakePuppeteer()];
});

const at = (limb: number | null, prop = 2): PropPresence => ({ prop, kind: "fan", limb, place: [0, 0, 0] });
/** Performers at x = 1 and x = 3; the second looks along x. */
const PERFORMERS = [
  { root: new Matrix4().setPosition(1, 1, 0) },
  {
    root: new Matrix4().compose(
      new Vector3(3, 1, 0),
      new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), Math.PI / 2),
      new Vector3(1, 1, 1),
    ),
  },
];

function put(limb: number | null) {
  return putProp({ viewer, puppeteer } as unknown as Playback, PERFORMERS, 2, limb);
}

test("a request is done once the session shows the prop in the hand", async () => {
  viewer.show(at(null));
  const done = vi.fn();
  const result = put(5).then(done);
  expect(puppeteer.sent).toEqual([[2, 5, null]]);
  viewer.show(at(null), at(5, 1));
  await Promise.resolve();
  expect(done).not.toHaveBeenCalled();
  viewer.show(at(5));
  await result;
  expect(done).toHaveBeenCalledWith(null);
});

test("a prop that is there already is not put again", async () => {
  viewer.show(at(5));
  expect(await put(5)).toBe(null);
  expect(puppeteer.sent).toEqual([]);
});

test("a prop is laid down before the performer who has it, or else where the session says", async () => {
  viewer.show(at(4));
  const laid = put(null);
  const [[, , place]] = puppeteer.sent as [[number, null, number[]]];
  [3.5, 0, Math.PI / 2].forEach((value, axis) => expect(place[axis]).toBeCloseTo(value, 9));
  viewer.show(at(null));
  expect(await laid).toBe(null);
  viewer.show(at(9));
  void put(null);
  expect(puppeteer.sent[1]).toEqual([2, null, null]);
});

test("a refusal of this prop ends the request with its reason", async () => {
  viewer.show(at(null));
  const result = put(0);
  puppeteer.refuse(1, "full");
  puppeteer.refuse(2, "held");
  expect(await result).toBe("held");
});

test("without a connection, or when it is lost, there is no answer", async () => {
  viewer.show(at(null));
  const lost = put(0);
  puppeteer.dispatchEvent(new Event("closed"));
  expect(await lost).toBe("no answer");
  puppeteer.isConnected = false;
  expect(await put(1)).toBe("no answer");
});

test("a request that nothing answers expires", async () => {
  vi.useFakeTimers();
  try {
    viewer.show(at(null));
    const result = put(0);
    await vi.runAllTimersAsync();
    expect(await result).toBe("no answer");
  } finally {
    vi.useRealTimers();
  }
});

describe("the prop nearest to a held hand", () => {
  /** Performers whose hands are half a metre to their sides. */
  const handed = PERFORMERS.map(({ root }) => ({
    root,
    hand: (limb: number, _: number, out: Matrix4) =>
      out.setPosition(new Vector3().setFromMatrixPosition(root).add(new Vector3(limb === 0 ? 0.5 : -0.5, 0, 0))),
  }));

  const move = (...held: number[]) =>
    moveNearestProp({ viewer, puppeteer } as unknown as Playback, handed, (limb) => held.includes(limb));
  const lying = (prop: number, x: number, z: number): PropPresence => ({
    prop,
    kind: "fan",
    limb: null,
    place: [x, z, 0],
  });

  test("is put into it from the floor below, or from another hand", async () => {
    viewer.show(lying(0, 1.7, 0), lying(1, 1.6, 0), lying(2, 3, 3));
    const moved = move(0, 1);
    expect(puppeteer.sent).toEqual([[1, 0, null]]);
    viewer.show({ ...lying(1, 0, 0), limb: 0 });
    expect(await moved).toEqual({ limb: 0, refusal: null });
    handed[1].root.setPosition(2.2, 1, 0);
    void move(5);
    expect(puppeteer.sent[1]).toEqual([1, 5, null]);
    handed[1].root.setPosition(3, 1, 0);
  });

  test("is laid down if it is in the hand", () => {
    viewer.show({ ...lying(3, 0, 0), limb: 1 }, lying(1, 0.5, 0));
    void move(1);
    expect(puppeteer.sent).toEqual([[3, null, [1, 0.5, 0]]]);
  });

  test("is none without a held hand, and beyond its reach", async () => {
    viewer.show(lying(0, 1.95, 0));
    expect(await move(0)).toEqual({ limb: null, refusal: "none near" });
    viewer.show(lying(0, 1.5, 0));
    expect(await move()).toEqual({ limb: null, refusal: "none near" });
    expect(puppeteer.sent).toEqual([]);
  });
});

test("the place before a performer is half a metre away, and turned like it", () => {
  expect(placeBefore(PERFORMERS[0])).toEqual([1, 0.5, 0]);
});
