/** Everything that stands on three.js, in one piece: the page is painted before it has come. */
export { Commands } from "./input/commands";
export { createGamepad } from "./input/gamepad";
export { Hands } from "./input/hands";
export { listenToKeyboard } from "./input/keyboard";
export { listenToMouse } from "./input/mouse";
export { createPointer } from "./input/pointer";
export { VelocityInputs } from "./input/velocity";
export { facePicture, puppetModel } from "./stage/model";
export { Stage } from "./stage/stage";
