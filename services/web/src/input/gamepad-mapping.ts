/**
 * From a gamepad of the W3C standard mapping to the two hands and two legs. Pure.
 *
 * Left stick: left hand, right and up; its trigger (L2) brings it nearer, with the shoulder button (L1) held further away.
 * With L1 held the stick is the left leg's. The right side of the pad does the same for the right side of the puppet.
 * A plays, the cross left and right seeks.
 */

export const BUTTON = { play: 0, left1: 4, right1: 5, left2: 6, right2: 7, up: 12, down: 13, left: 14, right: 15 } as const;

/** Sticks nearer their middle than this rest. */
export const DEAD_ZONE = 0.16;

export interface PadReading {
  /** By limb (0 left hand, 1 right hand, 2 left leg, 3 right leg): right, up, nearer in -1..1. */
  limbs: readonly (readonly [number, number, number])[];
  play: boolean;
  /** -1, 0 or 1. */
  seek: number;
}

/** What the mapping reads of a Gamepad. */
export interface PadInput {
  axes: readonly number[];
  buttons: readonly { pressed: boolean; value: number }[];
}

/** A stick without its dead zone: 0 in it, then rising from 0 to 1 at the rim, direction kept. */
export function stick(x: number, y: number): readonly [number, number] {
  const length = Math.hypot(x, y);
  if (!(length > DEAD_ZONE)) return [0, 0];
  const scale = (Math.min(1, length) - DEAD_ZONE) / (1 - DEAD_ZONE) / length;
  return [x * scale, y * scale];
}

export function readPad({ axes, buttons }: PadInput): PadReading {
  const value = (index: number) => buttons[index]?.value ?? 0;
  const pressed = (index: number) => buttons[index]?.pressed ?? false;
  const side = (axis: number, shoulder: number, trigger: number) => {
    const [x, y] = stick(axes[axis] ?? 0, -(axes[axis + 1] ?? 0));
    const depth = value(trigger) > 0.05 ? value(trigger) : 0;
    const shifted = pressed(shoulder);
    return {
      hand: [shifted ? 0 : x, shifted ? 0 : y, shifted ? -depth : depth] as const,
      leg: [0, shifted ? y : 0, 0] as const,
    };
  };
  const left = side(0, BUTTON.left1, BUTTON.left2);
  const right = side(2, BUTTON.right1, BUTTON.right2);
  return {
    limbs: [left.hand, right.hand, left.leg, right.leg],
    play: pressed(BUTTON.play),
    seek: Number(pressed(BUTTON.right)) - Number(pressed(BUTTON.left)),
  };
}
