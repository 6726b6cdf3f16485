/** State of the stage that the page's own elements follow: labels, controls and pointer. */
import type { ScreenBox } from "../stage/camera/screen-box";
import type { LabelLayout } from "../ui/strings/label-layout";
import type { StageState } from "./message";
import type { FrameState, StageController } from "./stage-controller";

/** Return the state of the stage after the frame of time `now` in milliseconds. */
export function describeStage(
  { stage, pointer, selectedPerformer }: StageController,
  { pose, limbs }: FrameState,
  labels: LabelLayout,
  now: number,
): StageState {
  const faces = stage.faceBoxes;
  const hand = pose && stage.nearerHand();
  const anchors = {
    limbs,
    bars: pose ? limbs.map((_, limb) => stage.barBox(limb)) : [],
    faces,
    hand: hand && stage.toScreen(hand),
  };
  return {
    hasPose: pose !== null,
    hasDrawnPerformer: stage.hasDrawnPerformer,
    labels: labels.update(anchors, selectedPerformer, now),
    faces: faces.map(roundBox),
    hasMotionCamera: stage.hasMotionCamera,
    followsMotionCamera: stage.followsMotionCamera,
    isPointerNear: pointer.hoveredLimb !== null,
    isPulling: pointer.isDragging,
  };
}

function roundBox({ left, top, right, bottom }: ScreenBox): ScreenBox {
  return { left: Math.round(left), top: Math.round(top), right: Math.round(right), bottom: Math.round(bottom) };
}
