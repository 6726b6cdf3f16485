/** Recording of pictures and frames in the realms of page and engine, for the benchmark of the webcam. */
import type { BodyMessage } from "../../../src/input/body-input";

/** Picture that the page has sent to the detector. Times are in milliseconds since the epoch but `now`, its name. */
export interface PictureSample {
  readonly now: number;
  /** Number that is drawn into the picture. */
  readonly number: number;
  readonly takenAt: number;
  readonly sentAt: number;
  answeredAt: number | null;
  /** Hands that were found. */
  hands: BodyMessage | null;
}

/** Frame that the engine has drawn: the picture whose hands it shows, and the performer's hands for those sides. */
export interface HandSample {
  readonly now: number;
  readonly shownAt: number;
  /** Relative to the shoulder, in arm lengths: outwards, up and forwards. */
  readonly hands: { readonly left: number[]; readonly right: number[] };
}

/** Pose that the page has sent as a live performer. */
export interface BodySample {
  /** In milliseconds since the epoch. */
  readonly sampledAt: number;
  /** The message. */
  readonly bytes: number[];
}

declare global {
  /** In the page's realm. */
  var webcamPictures: PictureSample[];
  var bodySamples: BodySample[];
  /** In the engine's realm. */
  var shownHands: HandSample[];
}

/** Record the pictures and hands that the page sends to its workers. Runs in the page before its scripts. */
export function recordPictures(): void {
  const [bits, square] = [10, 16];
  const pictures: PictureSample[] = [];
  globalThis.webcamPictures = pictures;
  const context = new OffscreenCanvas(bits * square, square).getContext("2d", { willReadFrequently: true });
  const readNumber = (picture: ImageBitmap): number => {
    if (!context) return -1;
    context.drawImage(picture, 0, 0);
    const { data } = context.getImageData(0, square / 2, bits * square, 1);
    return Array.from({ length: bits }, (_, bit) =>
      data[(bit * square + square / 2) * 4] > 127 ? 1 << bit : 0,
    ).reduce((sum, value) => sum + value);
  };
  const post = Worker.prototype.postMessage as (this: Worker, message: unknown, transfer?: unknown) => void;
  Worker.prototype.postMessage = function (this: Worker, message: unknown, transfer?: unknown) {
    const { picture, type, now, hands } = message as {
      picture?: ImageBitmap;
      type?: string;
      now: number;
      hands: BodyMessage;
    };
    if (picture) {
      pictures.push({
        now,
        number: readNumber(picture),
        takenAt: performance.timeOrigin + now,
        sentAt: performance.timeOrigin + performance.now(),
        answeredAt: null,
        hands: null,
      });
    } else if (type === "body") {
      const sample = pictures.findLast((one) => one.now === now);
      if (sample) Object.assign(sample, { hands, answeredAt: performance.timeOrigin + performance.now() });
    }
    post.call(this, message, transfer);
  } as Worker["postMessage"];
}

/** Record the poses that the page sends as a live performer. Runs in the page before its scripts. */
export function recordSamples(): void {
  const sampleType = 72;
  const samples: BodySample[] = [];
  globalThis.bodySamples = samples;
  const send = WebSocket.prototype.send;
  WebSocket.prototype.send = function (data) {
    if (data instanceof Uint8Array && data[0] === sampleType) {
      const microseconds = new DataView(data.buffer, data.byteOffset).getBigUint64(8, true);
      samples.push({ sampledAt: Number(microseconds) / 1000, bytes: [...data] });
    }
    send.call(this, data);
  };
}

/** Record which hands each frame shows. Runs in the engine. */
export function recordFrames(): void {
  const samples: HandSample[] = [];
  globalThis.shownHands = samples;
  const { stage } = globalThis.bunraku;
  let latest: number | null = null;
  globalThis.addEventListener("message", (event) => {
    const { type, now } = (event as MessageEvent<{ type: string; now: number }>).data;
    if (type === "body") latest = now;
  });
  /** As in a mirror: the person's left hand moves the performer's right. */
  const findHand = (side: "l" | "r"): number[] => {
    const [performer] = stage.performers;
    const at = (name: string) => performer.joint(name).elements;
    const place = (name: string) => [...at(name)].slice(12, 15);
    const between = (a: number[], b: number[]) => Math.hypot(...a.map((value, axis) => value - b[axis]));
    const [shoulder, elbow, wrist] = ["shoulder", "elbow", "wrist"].map((name) => place(`${side}_${name}`));
    const arm = between(shoulder, elbow) + between(elbow, wrist);
    const handle = performer.handle(side === "l" ? 0 : 1, stage.rig.group.position.clone());
    const offset = [handle.x, handle.y, handle.z].map((value, axis) => value - shoulder[axis]);
    const chest = at("vl5");
    return [0, 1, 2].map((column) => {
      const value = [0, 1, 2].reduce((sum, axis) => sum + chest[column * 4 + axis] * offset[axis], 0) / arm;
      return column === 0 && side === "r" ? -value : value;
    });
  };
  const draw = stage.draw.bind(stage);
  stage.draw = (...parameters: Parameters<typeof draw>) => {
    draw(...parameters);
    if (latest === null) return;
    samples.push({
      now: latest,
      shownAt: performance.timeOrigin + performance.now(),
      hands: { left: findHand("r"), right: findHand("l") },
    });
  };
}
