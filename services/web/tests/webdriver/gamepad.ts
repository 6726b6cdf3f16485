/**
 * A gamepad for the page. These functions run in the page. No driver connects gamepads to a browser: both browsers read
 * devices of the kernel, and the test interface of Firefox is closed outside of Mozilla's own tests. So the browser is
 * asked for its gamepads once, and then replaced by an object.
 */

type TestWindow = typeof globalThis & { testPad: { axes: number[] } };

/** Connect a gamepad with sticks at rest. */
export function connectGamepad(): void {
  if (navigator.getGamepads().some((pad) => pad)) throw new Error("There is a gamepad already");
  const buttons = Array.from({ length: 17 }, () => ({ pressed: false, touched: false, value: 0 }));
  const pad = { connected: true, mapping: "standard", id: "A pad", axes: [0, 0, 0, 0], buttons };
  navigator.getGamepads = () => [pad as unknown as Gamepad];
  (globalThis as TestWindow).testPad = pad;
  // As browsers do once a button is pressed.
  dispatchEvent(new Event("gamepadconnected"));
}

/** Move the left stick vertically, upwards to -1. */
export function moveStick(value: number): void {
  (globalThis as TestWindow).testPad.axes[1] = value;
}
