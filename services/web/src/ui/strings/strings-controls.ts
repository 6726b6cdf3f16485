/** Controls of the strings panel that are loaded when it opens. */
export { createCrowdControls } from "../crowd/crowd-controls";
export { createCameraButton } from "./camera-button";
export { createDirectionPad } from "./direction-pad";
export { createPropSection } from "./prop-section";
