/** Polls the first standard gamepad and dispatches the commands of its controls. */
import type { CommandInput } from "./command-dispatcher";
import { resolveControls } from "./gamepad-state";
import { type Control, isPadControl, type Mapping } from "./mapping";
import { OneEuro, smoothingSettings } from "./one-euro";

/** Beta of the stick filter, in Hz per full deflection per second: a flick is followed within one or two frames. */
const STICK_BETA = 3;

export interface GamepadInput {
  /** The gamepad in use, for its picture; null if there is none. */
  readonly pad: Gamepad | null;
  /**
   * Read the gamepad, once per frame. `now` is in milliseconds and never decreases. If not `enabled`, only detect the
   * gamepad.
   */
  update(now: number, enabled?: boolean): void;
}

export function createGamepadInput(
  commands: CommandInput,
  mapping: () => Mapping,
  pads: () => readonly (Gamepad | null)[],
): GamepadInput {
  const filters = [0, 1].map(() => new OneEuro(2, { minCutoff: 1, beta: STICK_BETA, derivativeCutoff: 1 }));
  let pad: Gamepad | null = null;
  let pressedBefore: readonly Control[] = [];

  /** Return the axes with smoothed sticks. A stick at rest resets its filter, so that no movement lingers. */
  const smooth = (axes: readonly number[], { deadZone, stickSmoothing }: Mapping, now: number): number[] => {
    const settings = smoothingSettings(stickSmoothing, STICK_BETA);
    const smoothed = [...axes];
    filters.forEach((filter, side) => {
      const [x, y] = axes.slice(side * 2, side * 2 + 2);
      if (!settings || y === undefined || Math.hypot(x, y) <= deadZone) {
        filter.reset();
        return;
      }
      filter.settings = settings;
      [smoothed[side * 2], smoothed[side * 2 + 1]] = filter.filter([x, y], now / 1000);
    });
    return smoothed;
  };

  return {
    get pad() {
      return pad;
    },
    update(now, enabled = true) {
      pad = pads().find((candidate) => candidate?.connected && candidate.mapping === "standard") ?? null;
      if (!pad || !enabled) {
        commands.releaseAll(isPadControl);
        pressedBefore = [];
        return;
      }
      const inputs = resolveControls({ axes: smooth(pad.axes, mapping(), now), buttons: pad.buttons }, mapping());
      const pressed = inputs.map(({ control }) => control);
      for (const control of pressedBefore) if (!pressed.includes(control)) commands.release(control, now);
      for (const { control, commands: bound, strength } of inputs) commands.press(control, bound, strength, now);
      pressedBefore = pressed;
    },
  };
}
