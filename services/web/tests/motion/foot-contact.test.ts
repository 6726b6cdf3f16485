import { expect, test } from "vitest";
import { markControlledLegs } from "../../src/motion/foot-contact";

test.each([
  { limbs: 0b0000, planted: 0b11, controlled: 0b00 },
  { limbs: 0b0011, planted: 0b11, controlled: 0b00 },
  { limbs: 0b0100, planted: 0b10, controlled: 0b01 },
  { limbs: 0b1001, planted: 0b01, controlled: 0b10 },
  { limbs: 0b1111, planted: 0b00, controlled: 0b11 },
])("limbs $limbs leave the contacts $planted", ({ limbs, planted, controlled }) => {
  const contacts = { planted: 0b11, controlled: 0, clock: 5 };
  markControlledLegs(contacts, limbs);
  expect(contacts).toEqual({ planted, controlled, clock: 5 });
});
