/** Small mirrored view of the person before the camera: the outline, over the darkened picture or without it. */
import type { DetectedBody } from "../../webcam/landmark";
import { element } from "../dom";
import { type Outline, outlineOf } from "./outline";

/** Pixels of the view: twice its size on the page, for sharp lines. */
export const [MIRROR_WIDTH, MIRROR_HEIGHT] = [440, 330];
const PICTURE_OPACITY = 0.42;
const LINE_WIDTH = 5;
const HAND_RADIUS = 11;

export interface MirrorContent {
  readonly video: HTMLVideoElement;
  readonly body: DetectedBody | null;
  /** Hands that move something on the stage. */
  readonly activeHands: { readonly left: boolean; readonly right: boolean };
}

export interface Mirror {
  readonly element: HTMLCanvasElement;
  /** Draw the picture under the outline. */
  showsPicture: boolean;
  draw(content: MirrorContent): void;
}

export function createMirror(): Mirror {
  const canvas = element("canvas", { width: MIRROR_WIDTH, height: MIRROR_HEIGHT, "aria-hidden": "true" });
  const context = canvas.getContext("2d");
  let showsPicture = true;
  let last: MirrorContent | null = null;
  const draw = (content: MirrorContent) => {
    last = content;
    if (!context) return;
    context.clearRect(0, 0, MIRROR_WIDTH, MIRROR_HEIGHT);
    if (showsPicture) drawPicture(context, content.video);
    if (!content.body) return;
    const style = getComputedStyle(canvas);
    const outline = outlineOf(content.body, MIRROR_WIDTH, MIRROR_HEIGHT);
    drawLines(context, outline, style.color);
    drawHands(context, outline, content.activeHands, style.getPropertyValue("--gold"));
  };
  return {
    element: canvas,
    get showsPicture() {
      return showsPicture;
    },
    set showsPicture(on) {
      showsPicture = on;
      if (last) draw(last);
    },
    draw,
  };
}

/** Draw the picture as large as the view, mirrored and darkened. */
function drawPicture(context: CanvasRenderingContext2D, video: HTMLVideoElement): void {
  if (video.videoWidth === 0) return;
  context.save();
  context.globalAlpha = PICTURE_OPACITY;
  context.filter = "saturate(0.35)";
  context.translate(MIRROR_WIDTH, 0);
  context.scale(-1, 1);
  context.drawImage(video, 0, 0, MIRROR_WIDTH, MIRROR_HEIGHT);
  context.restore();
}

function drawLines(context: CanvasRenderingContext2D, { lines, head }: Outline, colour: string): void {
  Object.assign(context, { lineWidth: LINE_WIDTH, lineCap: "round", lineJoin: "round", strokeStyle: colour });
  context.beginPath();
  for (const [[x, y], ...rest] of lines) {
    context.moveTo(x, y);
    for (const point of rest) context.lineTo(...point);
  }
  if (head) {
    context.moveTo(head.at[0] + head.radius, head.at[1]);
    context.arc(...head.at, head.radius, 0, 2 * Math.PI);
  }
  context.stroke();
}

/** Draw a disc for an active hand, and a ring for one that does not. */
function drawHands(
  context: CanvasRenderingContext2D,
  { hands }: Outline,
  isActive: MirrorContent["activeHands"],
  colour: string,
): void {
  Object.assign(context, { lineWidth: LINE_WIDTH, strokeStyle: colour, fillStyle: colour });
  for (const side of ["left", "right"] as const) {
    const at = hands[side];
    if (!at) continue;
    context.beginPath();
    context.arc(...at, HAND_RADIUS, 0, 2 * Math.PI);
    if (isActive[side]) context.fill();
    else context.stroke();
  }
}
