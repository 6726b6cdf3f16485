/** Bundle of everything that depends on three.js, loaded after the page was painted. */
export { StageController } from "./stage-controller";
export { describeStage } from "./stage-state";
