/** Bundle of everything that depends on three.js, loaded beside the engine. */
export { StageController } from "./stage-controller";
export { describeStage } from "./stage-state";
