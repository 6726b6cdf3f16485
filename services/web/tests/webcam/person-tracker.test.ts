import { describe, expect, test } from "vitest";
import { STILL_S } from "../../src/webcam/calibration";
import type { DetectedBody } from "../../src/webcam/landmark";
import { FORGET_S, PersonTracker, type TrackedPerson } from "../../src/webcam/person-tracker";
import { ASPECT, detect } from "./detected-body";
import { ARMS_DOWN } from "./poses";

const FPS = 15;

class Session {
  readonly tracker = new PersonTracker();
  now = 0;

  /** Show a picture for a time and return the last result. */
  show(body: DetectedBody | null, seconds: number): TrackedPerson {
    let last = this.tracker.update(body, ASPECT, this.now);
    for (const end = this.now + seconds; this.now < end; this.now += 1 / FPS)
      last = this.tracker.update(body, ASPECT, this.now);
    return last;
  }
}

/** Return a session in which the person has stood still. */
function calibrated(): Session {
  const session = new Session();
  session.show(detect(ARMS_DOWN), STILL_S + 0.5);
  return session;
}

describe("phases", () => {
  test("search, calibration, following", () => {
    const session = new Session();
    expect(session.show(null, 1)).toMatchObject({ phase: "searching", progress: 0 });
    const calibrating = session.show(detect(ARMS_DOWN), STILL_S / 2);
    expect(calibrating).toMatchObject({ phase: "calibrating", person: null });
    expect(calibrating.progress).toBeGreaterThan(0.3);
    expect(session.show(detect(ARMS_DOWN), STILL_S)).toMatchObject({ phase: "following", progress: 1 });
  });

  test("a person who returns goes on; one who comes later is calibrated", () => {
    const session = calibrated();
    expect(session.show(null, FORGET_S / 2).phase).toBe("searching");
    expect(session.show(detect(ARMS_DOWN), 0.1).phase).toBe("following");
    session.show(null, FORGET_S + 1);
    expect(session.show(detect(ARMS_DOWN), 0.1).phase).toBe("calibrating");
  });

  test("calibration on request", () => {
    const session = calibrated();
    session.tracker.recalibrate();
    expect(session.show(detect(ARMS_DOWN), 0.1).phase).toBe("calibrating");
  });
});

test("the size in the picture follows the person's distance, and stays while the person is not seen", () => {
  const session = calibrated();
  const scale = session.show(detect(ARMS_DOWN), 1).person?.scale ?? 0;
  const near = session.show(detect(ARMS_DOWN, { distance: 1.6 }), 6).person?.scale ?? 0;
  expect(near / scale).toBeCloseTo(2 / 1.6, 2);
  expect(session.show(null, 1).person).toMatchObject({ view: null, scale: near });
});
