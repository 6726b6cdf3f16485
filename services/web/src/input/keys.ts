/** Which keys do what. Pure; `keyboard.ts` listens. Letters go by their place on the keyboard, so W A S D is a cross anywhere. */

/** Directions of the audience: right, up, nearer; -1, 0 or 1 each. */
export type Direction = readonly [right: number, up: number, nearer: number];

const DIRECTIONS: Readonly<Record<string, Direction>> = {
  KeyD: [1, 0, 0], ArrowRight: [1, 0, 0],
  KeyA: [-1, 0, 0], ArrowLeft: [-1, 0, 0],
  KeyW: [0, 1, 0], ArrowUp: [0, 1, 0],
  KeyS: [0, -1, 0], ArrowDown: [0, -1, 0],
  KeyQ: [0, 0, 1], PageDown: [0, 0, 1],
  KeyE: [0, 0, -1], PageUp: [0, 0, -1],
};

/** Limbs of the keys 1 to 4: right hand, left hand, right leg, left leg. */
const LIMBS: Readonly<Record<string, number>> = { Digit1: 1, Digit2: 0, Digit3: 3, Digit4: 2, Numpad1: 1, Numpad2: 0, Numpad3: 3, Numpad4: 2 };

export function isDirection(code: string): boolean {
  return code in DIRECTIONS;
}

/** The limb a key takes, or null. */
export function limbOf(code: string): number | null {
  return LIMBS[code] ?? null;
}

/** The direction of all keys held down; opposite keys cancel, and a slant is no faster than a straight line. */
export function directionOf(codes: Iterable<string>): Direction {
  const sum = [0, 0, 0];
  for (const code of codes) (DIRECTIONS[code] ?? [0, 0, 0]).forEach((part, axis) => (sum[axis] += part));
  const signs = sum.map(Math.sign);
  const length = Math.hypot(...signs) || 1;
  return [signs[0] / length, signs[1] / length, signs[2] / length];
}
