import { expect, test } from "vitest";
import { armProportions } from "../../src/marionette/limbs";
import { parseProportions, proportionsOf } from "../../src/marionette/proportions";
import { golden } from "./golden";

test("an identity is the shape, whatever the size", () => {
  expect(proportionsOf(0.396, 0.352, 0.252).identity).toBe("396-352-252-560-320-120");
  expect(proportionsOf(39.6, 35.2, 25.2).identity).toBe("396-352-252-560-320-120");
  expect(proportionsOf(1, 1, 1).identity).toBe("334-333-333-560-320-120");
  for (let i = 1; i < 400; i++) {
    const { identity } = proportionsOf(0.3 + ((i * 0.618034) % 0.2), 0.3 + ((i * 0.754878) % 0.2), 0.15);
    const parts = identity.split("-").map(Number);
    expect(parts[0] + parts[1] + parts[2]).toBe(1000);
    expect(parseProportions(identity).identity).toBe(identity);
  }
});

test("the standard figure's arms have one identity", () => {
  const figure = {
    offsets: Float64Array.from(golden.limbs.offsets.flat()),
    tips: Float64Array.from(golden.limbs.tips.flat()),
  };
  expect(armProportions(figure, 0).identity).toBe("396-352-252-560-320-120");
  expect(armProportions(figure, 1).identity).toBe("396-352-252-560-320-120");
});

test("what is no arm is refused", () => {
  expect(() => proportionsOf(0.3, 0.3, 0)).toThrow(RangeError);
  expect(() => parseProportions("1-2-3")).toThrow(RangeError);
  expect(() => parseProportions("396-352-253-560-320-120")).toThrow(RangeError);
});
