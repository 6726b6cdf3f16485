import { expect, test } from "vitest";
import { armProportions } from "../../src/marionette/limbs";
import { parseProportions, proportionsOf } from "../../src/marionette/proportions";
import { golden } from "./golden";

test("identities are as the golden vectors say", () => {
  for (const { lengths, masses, identity } of golden.identities) {
    expect(proportionsOf(...lengths, masses ?? undefined).identity).toBe(identity);
  }
});

test("an identity is the shape, whatever the size, its masses those of its own links", () => {
  expect(proportionsOf(0.396, 0.352, 0.252).identity).toBe("396-352-252-531-344-125");
  expect(proportionsOf(39.6, 35.2, 25.2).identity).toBe("396-352-252-531-344-125");
  // the body whose masses they are has them
  expect(proportionsOf(0.186, 0.146, 0.108).identity).toBe("423-332-245-560-320-120");
  expect(proportionsOf(1, 1, 1).identity).toBe("334-333-333-477-347-176");
  expect(proportionsOf(1, 1, 1, [2, 1, 1]).identity).toBe("334-333-333-500-250-250");
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
  expect(armProportions(figure, 0).identity).toBe("396-352-252-532-344-124");
  expect(armProportions(figure, 1).identity).toBe("396-352-252-532-344-124");
});

test("what is no arm is refused", () => {
  expect(() => proportionsOf(0.3, 0.3, 0)).toThrow("lengths");
  expect(() => proportionsOf(0.3, 0.3, 0.2, [0, 0, 0])).toThrow("masses");
  expect(() => parseProportions("1-2-3")).toThrow(RangeError);
  expect(() => parseProportions("396-352-253-560-320-120")).toThrow(RangeError);
});
