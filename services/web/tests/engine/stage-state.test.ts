import { Vector3 } from "three";
import { expect, test } from "vitest";
import type { StageController } from "../../src/engine/stage-controller";
import { describeStage } from "../../src/engine/stage-state";
import type { Pose } from "../../src/motion/skeleton";
import type { LimbState } from "../../src/ui/limb-state";
import { LabelLayout } from "../../src/ui/strings/label-layout";

const HELD: LimbState = {
  holder: { id: "a", name: "Aiko", colour: 0, mine: true },
  requesters: [],
  requestedByMe: false,
  selected: false,
};
const POSE = {} as Pose;

function createController(hoveredLimb: number | null = null): StageController {
  return {
    stage: {
      faceBoxes: [{ left: 10.4, top: 20.5, right: 30.6, bottom: 40 }],
      barBox: () => ({ left: 660, top: 290, right: 740, bottom: 310 }),
      nearerHand: () => new Vector3(),
      toScreen: () => ({ x: 700, y: 400 }),
      hasDrawnPerformer: true,
      hasMotionCamera: true,
      followsMotionCamera: false,
    },
    pointer: { hoveredLimb, isDragging: false },
    selectedPerformer: 0,
  } as unknown as StageController;
}

function createLabels(): LabelLayout {
  const labels = new LabelLayout();
  labels.metrics = {
    tags: [[{ width: 140, height: 26 }]],
    invitation: { width: 100, height: 28 },
    viewport: { width: 1440, height: 900, top: 60 },
    obstacles: [],
  };
  return labels;
}

test("labels, camera, pointer and whole pixels of faces are described", () => {
  const state = describeStage(createController(2), { pose: POSE, limbs: [HELD] }, createLabels(), 0);
  expect(state).toMatchObject({
    hasPose: true,
    hasDrawnPerformer: true,
    labels: { tags: [{ form: 0, left: 630, top: 252 }], invitation: { form: 0 } },
    faces: [{ left: 10, top: 21, right: 31, bottom: 40 }],
    hasMotionCamera: true,
    followsMotionCamera: false,
    isPointerNear: true,
    isPulling: false,
  });
});

test("without a pose no label has a position", () => {
  const { hasPose, labels } = describeStage(createController(), { pose: null, limbs: [HELD] }, createLabels(), 0);
  expect([hasPose, labels]).toEqual([false, { tags: [null], invitation: null }]);
});
