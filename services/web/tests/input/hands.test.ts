import { Vector3 } from "three";
import { describe, expect, test } from "vitest";
import type { Puppeteer } from "../../src/client/puppeteer";
import { joint, LEFT_FINGER_TIP } from "../../src/stage/standard";
import { standingPuppet } from "../stage/standard-figure";
import { handsBefore, Session } from "./session";

const LEFT_HAND = 0;
const RIGHT_LEG = 3;
const ARM = ["l_shoulder", "l_elbow", "l_wrist"].map(joint).concat(LEFT_FINGER_TIP).reduce((sum, at, i, all) => sum + (i ? at.distanceTo(all[i - 1]) : 0), 0);

function close(actual: readonly unknown[], wanted: readonly number[]): void {
  expect(actual).toHaveLength(wanted.length);
  wanted.forEach((value, i) => expect(actual[i]).toBeCloseTo(value, 6));
}

describe("taking and letting go", () => {
  test("a limb is claimed once, however many ways of holding it follow, and released once", () => {
    const session = new Session();
    const hands = handsBefore(null, session);
    let told = 0;
    hands.changed = () => told++;
    expect(hands.take(LEFT_HAND, "velocity")).toBe(true);
    expect(hands.take(LEFT_HAND, "pointer")).toBe(true);
    expect(hands.source(LEFT_HAND)).toBe("pointer");
    hands.letGo(LEFT_HAND);
    hands.letGo(LEFT_HAND);
    expect(hands.source(LEFT_HAND)).toBe(null);
    expect(session.said).toEqual([["claim", LEFT_HAND], ["release", LEFT_HAND]]);
    expect(told).toBe(3);
  });

  test("nothing can be held without a session, or in one that has ended", () => {
    const hands = handsBefore(null, null);
    expect(hands.take(LEFT_HAND, "velocity")).toBe(false);
    const session = new Session();
    session.ended = true;
    hands.puppeteer = session as unknown as Puppeteer;
    expect(hands.take(LEFT_HAND, "velocity")).toBe(false);
    expect([hands.source(LEFT_HAND), session.said]).toEqual([null, []]);
  });

  test("a refused limb is not released, since it was never had", () => {
    const session = new Session();
    const hands = handsBefore(null, session);
    hands.take(LEFT_HAND, "velocity");
    hands.refused(LEFT_HAND);
    hands.letGo(LEFT_HAND);
    expect(hands.source(LEFT_HAND)).toBe(null);
    expect(session.said).toEqual([["claim", LEFT_HAND]]);
  });

  test("all that is held is let go together, and nothing else", () => {
    const session = new Session();
    const hands = handsBefore(null, session);
    hands.take(LEFT_HAND, "velocity");
    hands.take(RIGHT_LEG, "velocity");
    session.take();
    hands.letAllGo();
    expect(session.said).toEqual([["release", LEFT_HAND], ["release", RIGHT_LEG]]);
  });

  test("another session knows nothing of what was held in the one before", () => {
    const hands = handsBefore(standingPuppet(), new Session());
    hands.take(LEFT_HAND, "pointer");
    hands.pullTo(LEFT_HAND, new Vector3(1, 1, 1));
    const next = new Session();
    hands.puppeteer = next as unknown as Puppeteer;
    expect([hands.source(LEFT_HAND), hands.pull(LEFT_HAND)]).toEqual([null, null]);
    hands.letGo(LEFT_HAND);
    expect(next.said).toEqual([]);
  });
});

describe("pulling", () => {
  test("a limb that is not held stays", () => {
    const session = new Session();
    const hands = handsBefore(standingPuppet(), session);
    hands.pullTo(LEFT_HAND, new Vector3(1, 1, 1));
    hands.move(LEFT_HAND, 1, 0, 0);
    expect([hands.pull(LEFT_HAND), session.said]).toEqual([null, []]);
  });

  test("a ring pulled to where it is asks for the hand where it is, in arm lengths from the shoulder", () => {
    const session = new Session();
    const puppet = standingPuppet();
    const hands = handsBefore(puppet, session);
    hands.take(LEFT_HAND, "pointer");
    session.take();
    const ring = puppet.handle(LEFT_HAND, new Vector3());
    hands.pullTo(LEFT_HAND, ring);
    const tip = LEFT_FINGER_TIP.clone().sub(joint("l_shoulder")).divideScalar(ARM);
    const [[asked, limb, ...at]] = session.take();
    expect([asked, limb]).toEqual(["target", LEFT_HAND]);
    close(at, [...tip]);
    // What is pulled is where it was pulled to, not wherever the caller's vector goes next.
    ring.set(9, 9, 9);
    expect(hands.pull(LEFT_HAND)?.y).toBeLessThan(2);
  });

  test("the ring's way is the hand's way, in the axes of a chest that faces elsewhere", () => {
    const session = new Session();
    const puppet = standingPuppet(Math.PI / 2);
    const hands = handsBefore(puppet, session);
    hands.take(LEFT_HAND, "pointer");
    session.take();
    const ring = puppet.handle(LEFT_HAND, new Vector3());
    hands.pullTo(LEFT_HAND, ring);
    // The dancer faces x: a pull along x is forwards, z in the chest.
    hands.pullTo(LEFT_HAND, ring.clone().add(new Vector3(0.2, 0.1, 0)));
    const [[, , ...from], [, , ...to]] = session.take();
    close(to.map((value, axis) => value - from[axis]), [0, 0.1 / ARM, 0.2 / ARM]);
  });

  test("a knee pulled to the hip's height asks for a level thigh", () => {
    const session = new Session();
    const hands = handsBefore(standingPuppet(), session);
    hands.take(RIGHT_LEG, "pointer");
    session.take();
    hands.pullTo(RIGHT_LEG, joint("r_hip").add(new Vector3(0, 0, 0.4)));
    const [[asked, limb, ...angle]] = session.take();
    expect([asked, limb]).toEqual(["target", RIGHT_LEG]);
    close(angle, [Math.PI / 2, 0, 0]);
  });
});

describe("moving", () => {
  test("the audience's right, up and nearer arrive in the axes of the chest", () => {
    const session = new Session();
    const hands = handsBefore(standingPuppet(Math.PI / 2), session);
    hands.take(LEFT_HAND, "velocity");
    session.take();
    hands.move(LEFT_HAND, 1, 0.5, 0);
    hands.move(LEFT_HAND, 0, 0, 1);
    const [[, , ...right], [, , ...nearer]] = session.take();
    close(right, [0, 0.5, 1]);
    close(nearer, [-1, 0, 0]);
  });

  test("of a leg only up counts", () => {
    const session = new Session();
    const hands = handsBefore(standingPuppet(), session);
    hands.take(RIGHT_LEG, "velocity");
    hands.move(RIGHT_LEG, 1, -0.5, 1);
    expect(session.said.at(-1)).toEqual(["velocity", RIGHT_LEG, -0.5, 0, 0]);
  });

  test("a chest that only breathes makes no new input of a steady stick", () => {
    const said = [0, 0.004].map((yaw) => {
      const session = new Session();
      const hands = handsBefore(standingPuppet(yaw), session);
      hands.take(LEFT_HAND, "velocity");
      hands.move(LEFT_HAND, 0.7, 0.3, 0);
      return session.said.at(-1)?.map((value) => (value === 0 ? 0 : value));
    });
    expect(said[1]).toEqual(said[0]);
  });

  test("forgets the place it was pulled to", () => {
    const hands = handsBefore(standingPuppet(), new Session());
    hands.take(LEFT_HAND, "pointer");
    hands.pullTo(LEFT_HAND, new Vector3(0, 1, 0));
    expect(hands.pull(LEFT_HAND)).not.toBe(null);
    hands.move(LEFT_HAND, 0, 1, 0);
    expect(hands.pull(LEFT_HAND)).toBe(null);
  });
});
