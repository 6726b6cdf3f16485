/**
 * The two textures of the puppet, drawn once on a canvas: the face, and the asanoha (hemp leaf) pattern of the cloth.
 */
import { CanvasTexture, RepeatWrapping, SRGBColorSpace } from "three";
import { createCanvas, type StageCanvas } from "../rendering/canvas";

type Point = readonly [x: number, y: number];
type Context2D = CanvasRenderingContext2D | OffscreenCanvasRenderingContext2D;

function createContext(size: number): Context2D {
  // In software, since the graphics processor is preparing the stage at that time.
  const context = createCanvas(size, size).getContext("2d", { willReadFrequently: true });
  if (!context) throw new Error("The browser has no 2D canvas context for the puppet's textures.");
  return context as Context2D;
}

const FACE_TEXTURE_PX = 1024;
/** From metres on the mask to pixels; the projection is 0.20 x 0.26 m around the centre of the face. */
const toPixelX = (x: number) => (x / 0.2 + 0.5) * FACE_TEXTURE_PX;
const toPixelY = (y: number) => (0.5 - y / 0.26) * FACE_TEXTURE_PX;

/** Draw a brush stroke along a quadratic curve, with half widths at start, middle and end. */
function drawStroke(
  context: Context2D,
  [a, b, c]: readonly [Point, Point, Point],
  [wa, wb, wc]: readonly [number, number, number],
  ink: string,
): void {
  const steps = 60;
  const [left, right]: [Point[], Point[]] = [[], []];
  for (let i = 0; i <= steps; i++) {
    const t = i / steps;
    const [k0, k1, k2] = [(1 - t) ** 2, 2 * t * (1 - t), t ** 2];
    const [x, y] = [k0 * a[0] + k1 * b[0] + k2 * c[0], k0 * a[1] + k1 * b[1] + k2 * c[1]];
    const [dx, dy] = [(1 - t) * (b[0] - a[0]) + t * (c[0] - b[0]), (1 - t) * (b[1] - a[1]) + t * (c[1] - b[1])];
    const width = (k0 * wa + k1 * wb + k2 * wc) / (Math.hypot(dx, dy) || 1);
    left.push([x - dy * width, y + dx * width]);
    right.unshift([x + dy * width, y - dx * width]);
  }
  context.fillStyle = ink;
  context.beginPath();
  for (const [x, y] of [...left, ...right]) context.lineTo(toPixelX(x), toPixelY(y));
  context.fill();
}

function drawBlush(context: Context2D, x: number, y: number, radius: number, rgb: string, strength: number): void {
  const soft = context.createRadialGradient(toPixelX(x), toPixelY(y), 2, toPixelX(x), toPixelY(y), radius);
  soft.addColorStop(0, `rgba(${rgb},${strength})`);
  soft.addColorStop(1, `rgba(${rgb},0)`);
  context.fillStyle = soft;
  context.fillRect(toPixelX(x) - radius, toPixelY(y) - radius, 2 * radius, 2 * radius);
}

/** Create the face texture, which multiplies the colour of the gofun. */
export function createFaceTexture(): CanvasTexture<StageCanvas> {
  const context = createContext(FACE_TEXTURE_PX);
  context.fillStyle = "#fff";
  context.fillRect(0, 0, FACE_TEXTURE_PX, FACE_TEXTURE_PX);
  for (const s of [1, -1]) {
    drawBlush(context, s * 0.04, -0.022, 120, "214,96,72", 0.16);
    drawBlush(context, s * 0.03, 0.013, 85, "200,92,74", 0.2);
  }
  for (const s of [1, -1]) {
    const line = (points: readonly Point[]) =>
      points.map(([x, y]) => [s * x, y] as const) as unknown as readonly [Point, Point, Point];
    drawStroke(
      context,
      line([
        [0.012, 0.0275],
        [0.033, 0.043],
        [0.054, 0.0305],
      ]),
      [0.0012, 0.0046, 0.0004],
      "rgba(22,17,17,.96)",
    );
    drawEye(context, s);
    drawStroke(
      context,
      line([
        [0.012, 0.0012],
        [0.028, 0.0182],
        [0.049, 0.007],
      ]),
      [0.0009, 0.0031, 0.0006],
      "rgba(16,11,11,.98)",
    );
    drawStroke(
      context,
      line([
        [0.0155, 0.0008],
        [0.029, -0.0068],
        [0.045, 0.005],
      ]),
      [0.0003, 0.0009, 0.0004],
      "rgba(60,34,30,.75)",
    );
    drawStroke(
      context,
      line([
        [0.016, 0.009],
        [0.029, 0.0215],
        [0.0445, 0.0115],
      ]),
      [0.0002, 0.0007, 0.0002],
      "rgba(120,60,50,.45)",
    );
    context.fillStyle = "rgba(150,80,64,.3)";
    context.beginPath();
    context.ellipse(toPixelX(s * 0.0058), toPixelY(-0.0345), 7, 3, s * 0.4, 0, 2 * Math.PI);
    context.fill();
  }
  drawLips(context);
  const texture = new CanvasTexture(context.canvas);
  texture.colorSpace = SRGBColorSpace;
  texture.anisotropy = 8;
  return texture;
}

function drawEye(context: Context2D, s: number): void {
  context.save();
  context.beginPath();
  context.moveTo(toPixelX(s * 0.0135), toPixelY(0.0015));
  context.quadraticCurveTo(toPixelX(s * 0.028), toPixelY(0.017), toPixelX(s * 0.0455), toPixelY(0.0058));
  context.quadraticCurveTo(toPixelX(s * 0.029), toPixelY(-0.006), toPixelX(s * 0.0135), toPixelY(0.0015));
  context.fillStyle = "#fbf7ee";
  context.fill();
  context.clip();
  for (const [x, y, radius, ink] of [
    [0.0283, 0.006, 32, "#17110f"],
    [0.0283 + s * 0.0015, 0.0078, 5, "rgba(255,250,240,.9)"],
  ] as const) {
    context.fillStyle = ink;
    context.beginPath();
    context.arc(toPixelX(s * x), toPixelY(y), radius, 0, 2 * Math.PI);
    context.fill();
  }
  context.restore();
}

function drawLips(context: Context2D): void {
  const to = (cx: number, cy: number, x: number, y: number) =>
    context.quadraticCurveTo(toPixelX(cx), toPixelY(cy), toPixelX(x), toPixelY(y));
  context.fillStyle = "#cc4a34";
  context.beginPath();
  context.moveTo(toPixelX(-0.0165), toPixelY(-0.0585));
  to(-0.0065, -0.0538, 0, -0.0556);
  to(0.0065, -0.0538, 0.0165, -0.0585);
  to(0.008, -0.0658, 0, -0.0658);
  to(-0.008, -0.0658, -0.0165, -0.0585);
  context.fill();
  drawStroke(
    context,
    [
      [-0.0175, -0.058],
      [0, -0.06],
      [0.0175, -0.058],
    ],
    [0.0002, 0.0005, 0.0002],
    "rgba(110,26,18,.7)",
  );
}

/** Create a tile of white hemp-leaf lines on black. */
export function createAsanohaTexture(): CanvasTexture<StageCanvas> {
  const context = createContext(512);
  context.fillStyle = "#000";
  context.fillRect(0, 0, 512, 512);
  context.strokeStyle = "#fff";
  context.lineWidth = 5;
  const triangle = (...corners: Point[]) => {
    const middle: Point = [
      (corners[0][0] + corners[1][0] + corners[2][0]) / 3,
      (corners[0][1] + corners[1][1] + corners[2][1]) / 3,
    ];
    context.beginPath();
    for (const corner of corners) {
      context.moveTo(...corner);
      context.lineTo(...middle);
    }
    context.moveTo(...corners[0]);
    context.lineTo(...corners[1]);
    context.lineTo(...corners[2]);
    context.closePath();
    context.stroke();
  };
  for (let row = -1; row < 3; row++) {
    for (let column = -2; column < 4; column++) {
      const [x, y] = [column * 256 + (row % 2 ? 128 : 0), row * 256];
      triangle([x, y], [x + 256, y], [x + 128, y + 256]);
      triangle([x + 128, y + 256], [x + 384, y + 256], [x + 256, y]);
    }
  }
  const texture = new CanvasTexture(context.canvas);
  texture.wrapS = texture.wrapT = RepeatWrapping;
  texture.anisotropy = 8;
  return texture;
}
