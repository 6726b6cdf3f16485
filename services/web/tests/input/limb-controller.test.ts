import { Vector3 } from "three";
import { describe, expect, test } from "vitest";
import type { Puppeteer } from "../../src/client/puppeteer";
import { jointPosition, LEFT_FINGER_TIP } from "../../src/stage/puppet/standard-figure";
import { createStandingPuppet } from "../stage/puppet/figures";
import { createLimbController, FakePuppeteer } from "./fake-puppeteer";

const LEFT_HAND = 0;
const RIGHT_LEG = 3;
const ARM = ["l_shoulder", "l_elbow", "l_wrist"]
  .map(jointPosition)
  .concat(LEFT_FINGER_TIP)
  .reduce((sum, at, i, all) => sum + (i ? at.distanceTo(all[i - 1]) : 0), 0);

function close(actual: readonly unknown[], wanted: readonly number[]): void {
  expect(actual).toHaveLength(wanted.length);
  wanted.forEach((value, i) => expect(actual[i]).toBeCloseTo(value, 6));
}

describe("taking and letting go", () => {
  test("a limb is claimed once, however many ways of holding it follow, and released once", () => {
    const session = new FakePuppeteer();
    const hands = createLimbController(null, session);
    let told = 0;
    hands.onChange = () => told++;
    expect(hands.claim(LEFT_HAND, "velocity")).toBe(true);
    expect(hands.claim(LEFT_HAND, "pointer")).toBe(true);
    expect(hands.source(LEFT_HAND)).toBe("pointer");
    hands.release(LEFT_HAND);
    hands.release(LEFT_HAND);
    expect(hands.source(LEFT_HAND)).toBe(null);
    expect(session.calls).toEqual([
      ["claim", LEFT_HAND],
      ["release", LEFT_HAND],
    ]);
    expect(told).toBe(3);
  });

  test("nothing can be held without a session, or in one that has ended", () => {
    const hands = createLimbController(null, null);
    expect(hands.claim(LEFT_HAND, "velocity")).toBe(false);
    const session = new FakePuppeteer();
    session.ended = true;
    hands.puppeteer = session as unknown as Puppeteer;
    expect(hands.claim(LEFT_HAND, "velocity")).toBe(false);
    expect([hands.source(LEFT_HAND), session.calls]).toEqual([null, []]);
  });

  test("a refused limb is not released, since it was never had", () => {
    const session = new FakePuppeteer();
    const hands = createLimbController(null, session);
    hands.claim(LEFT_HAND, "velocity");
    hands.onRefused(LEFT_HAND);
    hands.release(LEFT_HAND);
    expect(hands.source(LEFT_HAND)).toBe(null);
    expect(session.calls).toEqual([["claim", LEFT_HAND]]);
  });

  test("all that is held is let go together, and nothing else", () => {
    const session = new FakePuppeteer();
    const hands = createLimbController(null, session);
    hands.claim(LEFT_HAND, "velocity");
    hands.claim(RIGHT_LEG, "velocity");
    session.takeCalls();
    hands.releaseAll();
    expect(session.calls).toEqual([
      ["release", LEFT_HAND],
      ["release", RIGHT_LEG],
    ]);
  });

  test("another session knows nothing of what was held in the one before", () => {
    const hands = createLimbController(createStandingPuppet(), new FakePuppeteer());
    hands.claim(LEFT_HAND, "pointer");
    hands.pullTo(LEFT_HAND, new Vector3(1, 1, 1));
    const next = new FakePuppeteer();
    hands.puppeteer = next as unknown as Puppeteer;
    expect([hands.source(LEFT_HAND), hands.pullTarget(LEFT_HAND)]).toEqual([null, null]);
    hands.release(LEFT_HAND);
    expect(next.calls).toEqual([]);
  });
});

describe("pulling", () => {
  test("a limb that is not held stays", () => {
    const session = new FakePuppeteer();
    const hands = createLimbController(createStandingPuppet(), session);
    hands.pullTo(LEFT_HAND, new Vector3(1, 1, 1));
    hands.move(LEFT_HAND, 1, 0, 0);
    expect([hands.pullTarget(LEFT_HAND), session.calls]).toEqual([null, []]);
  });

  test("a ring pulled to where it is asks for the hand where it is, in arm lengths from the shoulder", () => {
    const session = new FakePuppeteer();
    const puppet = createStandingPuppet();
    const hands = createLimbController(puppet, session);
    hands.claim(LEFT_HAND, "pointer");
    session.takeCalls();
    const ring = puppet.handle(LEFT_HAND, new Vector3());
    hands.pullTo(LEFT_HAND, ring);
    const tip = LEFT_FINGER_TIP.clone().sub(jointPosition("l_shoulder")).divideScalar(ARM);
    const [[asked, limb, ...at]] = session.takeCalls();
    expect([asked, limb]).toEqual(["target", LEFT_HAND]);
    close(at, [...tip]);
    // What is pulled is where it was pulled to, not wherever the caller's vector goes next.
    ring.set(9, 9, 9);
    expect(hands.pullTarget(LEFT_HAND)?.y).toBeLessThan(2);
  });

  test("the ring's way is the hand's way, in the axes of a chest that faces elsewhere", () => {
    const session = new FakePuppeteer();
    const puppet = createStandingPuppet(Math.PI / 2);
    const hands = createLimbController(puppet, session);
    hands.claim(LEFT_HAND, "pointer");
    session.takeCalls();
    const ring = puppet.handle(LEFT_HAND, new Vector3());
    hands.pullTo(LEFT_HAND, ring);
    // The dancer faces x: a pull along x is forwards, z in the chest.
    hands.pullTo(LEFT_HAND, ring.clone().add(new Vector3(0.2, 0.1, 0)));
    const [[, , ...from], [, , ...to]] = session.takeCalls();
    close(
      to.map((value, axis) => value - from[axis]),
      [0, 0.1 / ARM, 0.2 / ARM],
    );
  });

  test("a knee pulled to the hip's height asks for a level thigh", () => {
    const session = new FakePuppeteer();
    const hands = createLimbController(createStandingPuppet(), session);
    hands.claim(RIGHT_LEG, "pointer");
    session.takeCalls();
    hands.pullTo(RIGHT_LEG, jointPosition("r_hip").add(new Vector3(0, 0, 0.4)));
    const [[asked, limb, ...angle]] = session.takeCalls();
    expect([asked, limb]).toEqual(["target", RIGHT_LEG]);
    close(angle, [Math.PI / 2, 0, 0]);
  });
});

describe("moving", () => {
  test("the audience's right, up and nearer arrive in the axes of the chest", () => {
    const session = new FakePuppeteer();
    const hands = createLimbController(createStandingPuppet(Math.PI / 2), session);
    hands.claim(LEFT_HAND, "velocity");
    session.takeCalls();
    hands.move(LEFT_HAND, 1, 0.5, 0);
    hands.move(LEFT_HAND, 0, 0, 1);
    const [[, , ...right], [, , ...nearer]] = session.takeCalls();
    close(right, [0, 0.5, 1]);
    close(nearer, [-1, 0, 0]);
  });

  test("of a leg only up counts", () => {
    const session = new FakePuppeteer();
    const hands = createLimbController(createStandingPuppet(), session);
    hands.claim(RIGHT_LEG, "velocity");
    hands.move(RIGHT_LEG, 1, -0.5, 1);
    expect(session.calls.at(-1)).toEqual(["velocity", RIGHT_LEG, -0.5, 0, 0]);
  });

  test("a chest that only breathes makes no new input of a steady stick", () => {
    const said = [0, 0.004].map((yaw) => {
      const session = new FakePuppeteer();
      const hands = createLimbController(createStandingPuppet(yaw), session);
      hands.claim(LEFT_HAND, "velocity");
      hands.move(LEFT_HAND, 0.7, 0.3, 0);
      return session.calls.at(-1)?.map((value) => (value === 0 ? 0 : value));
    });
    expect(said[1]).toEqual(said[0]);
  });

  test("forgets the place it was pulled to", () => {
    const hands = createLimbController(createStandingPuppet(), new FakePuppeteer());
    hands.claim(LEFT_HAND, "pointer");
    hands.pullTo(LEFT_HAND, new Vector3(0, 1, 0));
    expect(hands.pullTarget(LEFT_HAND)).not.toBe(null);
    hands.move(LEFT_HAND, 0, 1, 0);
    expect(hands.pullTarget(LEFT_HAND)).toBe(null);
  });
});
