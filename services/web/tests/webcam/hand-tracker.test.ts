import { describe, expect, test } from "vitest";
import type { HandState } from "../../src/input/body-input";
import { STILL_S } from "../../src/webcam/calibration";
import { HandTracker, type TrackedHands } from "../../src/webcam/hand-tracker";
import { type DetectedBody, LANDMARK, LANDMARK_STRIDE } from "../../src/webcam/landmark";
import { HOLD_S } from "../../src/webcam/visibility-gate";
import { ASPECT, type DetectionOptions, detect, hide, trueReach } from "./detected-body";
import { FilmSession } from "./film-session";
import { ARMS_ASIDE, ARMS_DOWN, LEFT_UP } from "./poses";

class Session extends FilmSession<TrackedHands, HandTracker> {
  constructor() {
    super(new HandTracker(), 15);
  }
}

/** Return a session in which the person has stood still. */
function calibrated(options?: DetectionOptions): Session {
  const session = new Session();
  session.show(detect(ARMS_DOWN, options), STILL_S + 0.5);
  return session;
}

function expectReach(state: HandState, expected: readonly number[], digits = 2): void {
  expect(state).toHaveLength(3);
  expected.forEach((value, axis) => void expect(state?.[axis]).toBeCloseTo(value, digits));
}

describe("hands", () => {
  test.each([{ distance: 3 }, { distance: 3, modelScale: 0.7 }, { distance: 4, right: 0.3 }])(
    "reach where those of the person do: %o",
    (options) => {
      const session = calibrated(options);
      const { hands } = session.show(detect(ARMS_ASIDE, options), 2);
      expectReach(hands.left, trueReach(ARMS_ASIDE, "left"));
      expectReach(hands.right, trueReach(ARMS_ASIDE, "right"));
    },
  );

  test("follow a person who comes nearer", () => {
    const session = calibrated({ distance: 3.5 });
    const { hands } = session.show(detect(LEFT_UP, { distance: 2.6 }), 6);
    expectReach(hands.right, trueReach(LEFT_UP, "right"));
  });

  test("shoulders that become narrower with raised arms do not change the size", () => {
    for (const hidden of [[], ["leftHip"]] as const) {
      const session = new Session();
      const narrow = (body: DetectedBody) => {
        for (const side of ["left", "right"] as const) {
          const at = LANDMARK[`${side}Shoulder`] * LANDMARK_STRIDE;
          body.image[at] = 0.5 + (body.image[at] - 0.5) * 0.85;
        }
        return body;
      };
      session.show(hide(detect(ARMS_DOWN, { distance: 3 }), 0.1, ...hidden), STILL_S + 0.5);
      const raised = () => narrow(hide(detect(LEFT_UP, { distance: 3 }), 0.1, ...hidden));
      const { hands } = session.show(raised(), 1.5);
      expect(hands.left?.[1]).toBeCloseTo(trueReach(LEFT_UP, "left")[1], 1);
    }
  });

  test("do not jump when the person moves at once", () => {
    const session = calibrated({ distance: 3 });
    const before = session.show(detect(ARMS_DOWN, { distance: 3 }), 0.2).hands.left;
    const after = session.tracker.update(detect(ARMS_ASIDE, { distance: 3 }), ASPECT, session.now).hands.left;
    if (!before || before === "hold" || !after || after === "hold") throw new Error("The hand is not followed.");
    const truth = trueReach(ARMS_ASIDE, "left");
    expect(after[0]).toBeGreaterThan(before[0]);
    expect(after[0]).toBeLessThan(truth[0]);
  });

  test("a hidden hand is held, then released; the other goes on", () => {
    const session = calibrated();
    const body = () => hide(detect(ARMS_DOWN), 0.1, "leftWrist");
    expect(session.show(body(), 0.3).hands.left).toBe("hold");
    const { hands } = session.show(body(), HOLD_S);
    expect(hands.left).toBe(null);
    expect(hands.right).toHaveLength(3);
  });

  test("of a person who leaves are held, then released", () => {
    const session = calibrated();
    expect(session.show(null, 0.3)).toMatchObject({ phase: "searching", hands: { left: "hold", right: "hold" } });
    expect(session.show(null, HOLD_S).hands).toEqual({ left: null, right: null });
  });
});
