/** Everything that stands on three.js, in one piece: the page is painted before it has come. */
export { createGamepadInput as createGamepad } from "../input/gamepad";
export { listenToKeyboard } from "../input/keyboard";
export { listenToMouse } from "../input/mouse";
export { createPuppetModel as puppetModel, renderFacePng as facePicture } from "../stage/puppet/puppet-model";
export { StageController as Performing } from "./stage-controller";
