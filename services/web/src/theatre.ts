/** Everything that stands on three.js, in one piece: the page is painted before it has come. */
export { createGamepad } from "./input/gamepad";
export { listenToKeyboard } from "./input/keyboard";
export { listenToMouse } from "./input/mouse";
export { Performing } from "./performing";
export { facePicture, puppetModel } from "./stage/model";
