/** State of the stage that the page's own elements follow: name tags, controls and pointer. */
import type { StageState } from "./message";
import type { FrameState, StageController } from "./stage-controller";

/** Return the state of the stage after a frame. */
export function describeStage({ stage, pointer }: StageController, frame: FrameState): StageState {
  const hand = stage.nearerHand();
  return {
    hasPose: frame.pose !== null,
    hasDrawnPerformer: stage.hasDrawnPerformer,
    limbs: frame.limbs,
    bars: frame.pose ? frame.limbs.map((_, limb) => stage.barBox(limb)) : [],
    faces: stage.faceBoxes,
    nearerHand: hand && stage.toScreen(hand),
    hasMotionCamera: stage.hasMotionCamera,
    followsMotionCamera: stage.followsMotionCamera,
    isPointerNear: pointer.hoveredLimb !== null,
    isPulling: pointer.isDragging,
  };
}
