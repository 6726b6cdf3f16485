import { describe, expect, test } from "vitest";
import { STILL_S } from "../../src/webcam/calibration";
import { FORGET_S, PersonTracker, type TrackedPerson } from "../../src/webcam/person-tracker";
import { detect } from "./detected-body";
import { FilmSession } from "./film-session";
import { ARMS_DOWN } from "./poses";

class Session extends FilmSession<TrackedPerson, PersonTracker> {
  constructor() {
    super(new PersonTracker(), 15);
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
