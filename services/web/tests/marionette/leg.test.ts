import { expect, test } from "vitest";
import { THIGH_GREATEST, THIGH_LEAST, clampThigh, kneeBend } from "../../src/marionette/leg";

test("the knee bends one way and lets the shank hang", () => {
  for (let theta = -4; theta <= 4; theta += 0.125) {
    const thigh = clampThigh(theta);
    expect(thigh).toBeGreaterThanOrEqual(THIGH_LEAST);
    expect(thigh).toBeLessThanOrEqual(THIGH_GREATEST);
    // the shank's own angle from straight down
    expect(thigh - kneeBend(thigh)).toBe(Math.min(thigh, 0));
  }
});
