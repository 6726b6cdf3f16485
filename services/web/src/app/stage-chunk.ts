/** Bundle of everything that depends on three.js, loaded after the page was painted. */
export { createGamepadInput } from "../input/gamepad";
export { listenToKeyboard } from "../input/keyboard";
export { listenToMouse } from "../input/mouse";
export { createPuppetModel, renderFacePng } from "../stage/puppet/puppet-model";
export { StageController } from "./stage-controller";
