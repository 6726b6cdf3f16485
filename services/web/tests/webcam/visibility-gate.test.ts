import { expect, test } from "vitest";
import { HOLD_S, KEEP_VISIBILITY, TAKE_S, TAKE_VISIBILITY, VisibilityGate } from "../../src/webcam/visibility-gate";

const [CLEAR, FAINT, GONE] = [TAKE_VISIBILITY, KEEP_VISIBILITY, KEEP_VISIBILITY - 0.01];

test("a hand is taken after it was clearly seen for a moment", () => {
  const gate = new VisibilityGate();
  expect(gate.update(FAINT, 0)).toBe("lost");
  expect(gate.update(CLEAR, 1)).toBe("lost");
  expect(gate.update(CLEAR, 1 + TAKE_S / 2)).toBe("lost");
  expect(gate.update(CLEAR, 1.001 + TAKE_S)).toBe("seen");
});

test("a flash is no hand", () => {
  const gate = new VisibilityGate();
  for (let now = 0; now < 5; now += TAKE_S) {
    expect(gate.update(CLEAR, now)).toBe("lost");
    expect(gate.update(GONE, now + TAKE_S / 2)).toBe("lost");
  }
});

test("a taken hand is kept while it is faint", () => {
  const gate = new VisibilityGate();
  gate.update(CLEAR, 0);
  for (let now = TAKE_S; now < 10; now += 0.5) expect(gate.update(now === TAKE_S ? CLEAR : FAINT, now)).toBe("seen");
});

test("a taken hand that is gone is held, then lost", () => {
  const gate = new VisibilityGate();
  gate.update(CLEAR, 0);
  gate.update(CLEAR, TAKE_S);
  expect(gate.update(GONE, TAKE_S + 0.1)).toBe("held");
  expect(gate.update(GONE, TAKE_S + HOLD_S)).toBe("held");
  expect(gate.update(GONE, TAKE_S + HOLD_S + 0.01)).toBe("lost");
  expect(gate.update(FAINT, TAKE_S + HOLD_S + 0.02)).toBe("lost");
});

test("a held hand goes on at once when it is seen again", () => {
  const gate = new VisibilityGate();
  gate.update(CLEAR, 0);
  gate.update(CLEAR, TAKE_S);
  gate.update(GONE, TAKE_S + HOLD_S / 2);
  expect(gate.update(FAINT, TAKE_S + HOLD_S)).toBe("seen");
  expect(gate.update(GONE, TAKE_S + 2 * HOLD_S)).toBe("held");
});
