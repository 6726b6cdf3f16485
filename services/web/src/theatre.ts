/** Everything that stands on three.js, in one piece: the page is painted before it has come. */
export { createGamepad } from "./input/gamepad";
export { Hands } from "./input/hands";
export { createKeyboard } from "./input/keyboard";
export { createPointer } from "./input/pointer";
export { Stage } from "./stage/stage";
