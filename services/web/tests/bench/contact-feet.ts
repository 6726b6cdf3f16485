/**
 * Slide of planted feet, for `make bench-contact`: stored motions on the puppet, on a puppet whose base is moved, and on
 * avatars, with and without the correction. Reads JSON from standard input and prints a JSON object as its last line.
 */
import { existsSync, readFileSync } from "node:fs";
import { decode } from "@msgpack/msgpack";
import { type Object3D, Texture, Vector3 } from "three";
import { Avatar } from "../../src/avatar/avatar";
import { AvatarModel } from "../../src/avatar/model";
import { MotionTrack } from "../../src/codec/motion-track";
import type { StagedPose } from "../../src/motion/extension";
import { type Figure, restPose } from "../../src/motion/skeleton";
import { MotionBlockStore } from "../../src/playout/block-store";
import { ExtensionPoses } from "../../src/playout/extension-poses";
import { openExtension } from "../../src/playout/extension-values";
import type { Performer } from "../../src/stage/puppet/performer";
import { PlantedFeet } from "../../src/stage/puppet/planted-feet";
import { Puppet, setPlantedFeet } from "../../src/stage/puppet/puppet";
import { PuppetAssets } from "../../src/stage/puppet/puppet-assets";
import { SIDES } from "../../src/stage/puppet/standard-figure";
import { unpackServerMessage } from "../../src/wire/client-codec";
import type { Data, Description } from "../../src/wire/messages";
import { createFigureFile } from "../avatar/figure-files";
import { readVrmSample, VRM_FOLDER } from "../avatar/vrm-samples";

interface BenchInput {
  /** Objects of the motion store. */
  clips: { name: string; file: string }[];
  /** Mean error of the level to play, mm: the nearest one. */
  meanErrorMm: number;
}

/** Steps of one figure in one clip. */
interface Result {
  figure: string;
  clip: string;
  /** Slide of each step before and after the correction, mm. */
  before: number[];
  after: number[];
  /** Distance by which the correction moves the planted feet, mm, frame by frame. */
  corrections: number[];
  /** Largest change of that distance, of feet and knees, from one frame to the next, mm. */
  maxChange: number;
  /** Time of the correction in a frame, microseconds. */
  correctionUs: number;
}

const FPS = 60;
/** Movement of the base by a pull: size in metres and frequency in Hz along each axis. */
const SWAY: readonly (readonly [number, number])[] = [
  [0.06, 0.4],
  [0.03, 0.3],
  [0.05, 0.5],
];
const VRM_SAMPLES = ["Godette_vrm_v4.vrm", "cool_loops.vrm", "cryptovoxels.vrm"];

/** A drawn figure, and the places of the balls of its feet and of its knees. */
interface DrawnFigure {
  performer: Performer;
  balls(): Vector3[];
  knees(): Vector3[];
  isSwayed?: boolean;
}

class Clip {
  private readonly store: MotionBlockStore;
  private readonly extensions = new ExtensionPoses(openExtension);
  private readonly pose = restPose();

  constructor(file: string, meanErrorMm: number) {
    const { description, tracks } = decode(readFileSync(file)) as { description: Uint8Array; tracks: Uint8Array[][][] };
    const described = (unpackServerMessage(description) as Description & { name: "Description" }).tracks;
    this.store = new MotionBlockStore(MotionTrack.fromDescription(described[0]));
    const apart = this.store.track.ladder.map(({ mean }) => Math.abs(Math.log(mean / meanErrorMm)));
    const level = apart.indexOf(Math.min(...apart));
    this.extensions.add(
      new Map(described.map((track, index) => [index, track] as const).filter(([index]) => index > 0)),
    );
    tracks.forEach((levels, track) => {
      for (const packet of levels[track === 0 ? level : levels.length - 1]) {
        const data = unpackServerMessage(packet) as Data & { name: "Data" };
        if (track === 0) this.store.put(data.index, data.rate, data.block);
        else this.extensions.put(data);
      }
    });
  }

  get figure(): Figure {
    return this.store.track.figure;
  }

  get frameCount(): number {
    return Math.floor((this.store.track.durationUs * FPS) / 1e6);
  }

  /** Return the pose of a frame, in storage that the next call reuses. */
  poseAt(frame: number): StagedPose {
    const position = Math.round((frame * 1e6) / FPS);
    const pose: StagedPose = this.pose;
    this.store.poseAt(position, false, pose);
    const { durationUs: duration } = this.store.track;
    this.extensions.performer(0)?.extend(this.figure, pose, { clock: position, position, loop: false, duration });
    return pose;
  }
}

const worldOf = (node: Object3D) => new Vector3().setFromMatrixPosition(node.matrixWorld);

/** Play a clip, and return for each frame the balls of the feet, the knees and the planted feet. */
function play(clip: Clip, drawn: DrawnFigure, isCorrected: boolean) {
  return Array.from({ length: clip.frameCount }, (_, frame) => {
    const pose = clip.poseAt(frame);
    const planted = pose.contacts?.planted ?? 0;
    if (!isCorrected) pose.contacts = null;
    if (drawn.isSwayed) {
      SWAY.forEach(([size, rate], axis) => {
        pose.root[axis] += size * Math.sin((2 * Math.PI * rate * frame) / FPS);
      });
    }
    drawn.performer.apply(pose, 1 / FPS);
    return { balls: drawn.balls(), knees: drawn.knees(), planted };
  });
}

type Frames = ReturnType<typeof play>;

/** Return the largest distance over the floor from the first place of each contact, mm. */
function slides(frames: Frames): number[] {
  const found: number[] = [];
  SIDES.forEach((_, side) => {
    let place: Vector3 | null = null;
    for (const { balls, planted } of frames) {
      if (((planted >> side) & 1) === 0) {
        place = null;
        continue;
      }
      if (!place) {
        place = balls[side];
        found.push(0);
      }
      const slide = 1e3 * Math.hypot(balls[side].x - place.x, balls[side].z - place.z);
      found[found.length - 1] = Math.max(found[found.length - 1], slide);
    }
  });
  return found;
}

/** Return how far the correction moves the planted feet in each frame, mm. */
function corrections(before: Frames, after: Frames): number[] {
  return after.flatMap(({ balls, planted }, frame) =>
    balls.flatMap((ball, side) =>
      ((planted >> side) & 1) !== 0 ? [1e3 * ball.distanceTo(before[frame].balls[side])] : [],
    ),
  );
}

/** Return the largest change of the correction of a foot or knee from one frame to the next, mm. */
function maxChange(before: Frames, after: Frames): number {
  const moved = after.map(({ balls, knees }, frame) => {
    const plain = [...before[frame].balls, ...before[frame].knees];
    return [...balls, ...knees].map((place, n) => place.clone().sub(plain[n]));
  });
  const changes = moved.slice(1).flatMap((places, at) => places.map((place, n) => place.distanceTo(moved[at][n])));
  return 1e3 * Math.max(...changes);
}

/** Return the time that the correction takes in a frame, microseconds: the difference of the medians. */
function correctionTime(clip: Clip, drawn: DrawnFigure): number {
  const median = (isCorrected: boolean) => {
    const times = Array.from({ length: clip.frameCount }, (_, frame) => {
      const pose = clip.poseAt(frame);
      if (!isCorrected) pose.contacts = null;
      const begin = performance.now();
      drawn.performer.apply(pose, 1 / FPS);
      return performance.now() - begin;
    });
    return 1e3 * times.sort((a, b) => a - b)[times.length >> 1];
  };
  median(true);
  return Math.max(median(true) - median(false), 0);
}

function drawPuppet(figure: Figure, isSwayed: boolean): DrawnFigure {
  const performer = new Puppet(
    figure,
    new PuppetAssets({ face: new Texture(), asanoha: new Texture() }, { value: 0 }),
    true,
  );
  const joints = (name: string) =>
    SIDES.map(({ side }) => new Vector3().setFromMatrixPosition(performer.joint(`${side}_${name}`)));
  return { performer, balls: () => joints("midtarsal"), knees: () => joints("knee"), isSwayed };
}

function drawAvatar(model: AvatarModel, figure: Figure): DrawnFigure {
  const nodes = (bone: string) => ["left", "right"].map((side) => model.nodes.get(`${side}${bone}`) as Object3D);
  const points = ["leftFoot", "rightFoot"].map((foot) => (model.rest.solePoints.get(foot) as readonly Vector3[])[1]);
  return {
    performer: new Avatar(model, figure),
    balls: () => nodes("Foot").map((foot, side) => points[side].clone().applyMatrix4(foot.matrixWorld)),
    knees: () => nodes("LowerLeg").map(worldOf),
  };
}

/** Return the figures by name: functions that draw them with the lengths of a clip. */
async function createFigures(): Promise<[string, (figure: Figure) => DrawnFigure][]> {
  const models: [string, AvatarModel][] = [];
  for (const [name, legLength] of [
    ["short legs", 0.7],
    ["long legs", 1.3],
  ] as const) {
    const file = createFigureFile({ vrm: 1, legLength, askew: true });
    models.push([`avatar, ${name}`, await AvatarModel.parse(file.buffer, name)]);
  }
  if (existsSync(VRM_FOLDER))
    for (const name of VRM_SAMPLES) models.push([`avatar, ${name}`, await readVrmSample(name)]);
  else models.push(["avatar, an adult", await AvatarModel.parse(createFigureFile({ vrm: 0 }).buffer, "adult")]);
  return [
    ["puppet", (figure) => drawPuppet(figure, false)],
    ["puppet, base moved", (figure) => drawPuppet(figure, true)],
    ...models.map(([name, model]): [string, (figure: Figure) => DrawnFigure] => [
      name,
      (figure) => drawAvatar(model, figure),
    ]),
  ];
}

setPlantedFeet(PlantedFeet);
const { clips, meanErrorMm } = JSON.parse(readFileSync(0, "utf8")) as BenchInput;
const results: Result[] = [];
for (const [figure, draw] of await createFigures()) {
  for (const { name, file } of clips) {
    const clip = new Clip(file, meanErrorMm);
    const [before, after] = [false, true].map((isCorrected) => {
      const drawn = draw(clip.figure);
      const frames = play(clip, drawn, isCorrected);
      drawn.performer.dispose();
      return frames;
    });
    results.push({
      figure,
      clip: name,
      before: slides(before),
      after: slides(after),
      corrections: corrections(before, after),
      maxChange: maxChange(before, after),
      correctionUs: correctionTime(clip, draw(clip.figure)),
    });
  }
}
console.log(JSON.stringify(results));
