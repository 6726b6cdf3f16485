import { expect, test } from "vitest";
import { armProportions } from "../../src/marionette/limb-rig";
import { parseProportions, proportionsFromLinks } from "../../src/marionette/proportions";
import { golden } from "./golden";

test("identities equal the golden vectors", () => {
  for (const { lengths, masses, identity } of golden.identities) {
    expect(proportionsFromLinks(...lengths, masses ?? undefined).identity).toBe(identity);
  }
});

test("identity is independent of size, with masses by link length", () => {
  expect(proportionsFromLinks(0.396, 0.352, 0.252).identity).toBe("3960-3520-2520-5314-3438-1248");
  expect(proportionsFromLinks(39.6, 35.2, 25.2).identity).toBe("3960-3520-2520-5314-3438-1248");
  // a body with the reference lengths has the reference masses
  expect(proportionsFromLinks(0.186, 0.146, 0.108).identity).toBe("4227-3318-2455-5600-3200-1200");
  expect(proportionsFromLinks(1, 1, 1).identity).toBe("3334-3333-3333-4769-3471-1760");
  expect(proportionsFromLinks(1, 1, 1, [2, 1, 1]).identity).toBe("3334-3333-3333-5000-2500-2500");
  for (let i = 1; i < 400; i++) {
    const { identity } = proportionsFromLinks(0.3 + ((i * 0.618034) % 0.2), 0.3 + ((i * 0.754878) % 0.2), 0.15);
    const parts = identity.split("-").map(Number);
    expect([1_000, 10_000]).toContain(parts[0] + parts[1] + parts[2]);
    expect(parseProportions(identity).identity).toBe(identity);
  }
});

test("identity is in thousandths where exact", () => {
  expect(proportionsFromLinks(0.4, 0.35, 0.25, [0.5, 0.3, 0.2]).identity).toBe("400-350-250-500-300-200");
  const { upper, forearm, hand } = parseProportions("4001-3500-2499-5000-3000-2000");
  expect([upper, forearm, hand]).toEqual([0.4001, 0.35, 0.2499]);
});

test("both arms of the standard figure have the same identity", () => {
  const figure = {
    offsets: Float64Array.from(golden.limbs.offsets.flat()),
    tips: Float64Array.from(golden.limbs.tips.flat()),
  };
  expect(armProportions(figure, 0).identity).toBe("3963-3523-2514-5316-3440-1244");
  expect(armProportions(figure, 1).identity).toBe("3963-3523-2514-5316-3440-1244");
});

test("invalid proportions throw RangeError", () => {
  expect(() => proportionsFromLinks(0.3, 0.3, 0)).toThrow("lengths");
  expect(() => proportionsFromLinks(0.3, 0.3, 0.2, [0, 0, 0])).toThrow("masses");
  expect(() => parseProportions("1-2-3")).toThrow(RangeError);
  expect(() => parseProportions("396-352-253-560-320-120")).toThrow(RangeError);
});
