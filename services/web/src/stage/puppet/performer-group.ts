/** Performers on the stage: a puppet, or an avatar in its place, for each performer of the motion. */
import { type Camera, Group, type IUniform, type Scene, Vector3, type WebGLRenderer } from "three";
import type { StagedPose } from "../../motion/extension";
import { type Figure, LIMBS } from "../../motion/skeleton";
import { STANDING_HEIGHT_M } from "../camera/audience-camera";
import type { ScreenBox, WorldExtent } from "../camera/screen-box";
import type { ScreenProjection } from "../camera/screen-projection";
import type { Look } from "../scenery/look";
import type { AutoBlink } from "./face/auto-blink";
import type { Performer } from "./performer";
import { Puppet } from "./puppet";
import { PuppetAssets } from "./puppet-assets";
import { createAsanohaTexture, createFaceTexture } from "./texture";

/** Creates a performer for the limb lengths that the stream describes. */
export type PerformerFactory = (figure: Figure) => Performer;

/** Joints that span a figure, and how far its clothes and hair reach beyond them on the standard figure. */
const OUTER_JOINTS = [
  "skullbase",
  ...["l", "r"].flatMap((side) => [`${side}_elbow`, `${side}_wrist`, `${side}_knee`, `${side}_ankle`]),
];
const CLOTHES_EXTENT: WorldExtent = { across: 0.3, up: 0.3, down: 0.3 };
/** The joint in the middle of a figure, and the extent of the trunk around it. */
const MIDDLE_JOINT = "vl5";
const TRUNK_EXTENT: WorldExtent = { across: 0.3, up: 0.5, down: 0.5 };
/** Extent of a face on the standard figure. */
const FACE_EXTENT: WorldExtent = { across: 0.1, up: 0.16, down: 0.14 };

/** Time after the first pose after which performers blink, in seconds. */
const BLINK_DELAY_S = 2;

const at = new Vector3();

export class PerformerGroup {
  readonly group = new Group();
  readonly #performers: Performer[] = [];
  /** Index: performer. Null or missing: a puppet. */
  readonly #factories: (PerformerFactory | null)[] = [];
  #assets: PuppetAssets | null = null;
  /** Null until they are loaded. */
  #blinks: AutoBlink | null = null;
  #movedS = 0;
  #showsReflection = false;
  #usesSimpleMaterials = false;

  /** `floorHeight` is the height of the reflecting floor. */
  constructor(private readonly floorHeight: IUniform<number>) {
    this.group.name = "performers";
  }

  /** Performers in the order of the motion's tracks. */
  get performers(): readonly Performer[] {
    return this.#performers;
  }

  /** Performers that have had a pose. */
  get visiblePerformers(): readonly Performer[] {
    return this.#performers.filter(({ group }) => group.visible);
  }

  /** World positions of the handles by limb number, null for those of an invisible performer. */
  get handles(): (Vector3 | null)[] {
    return this.#performers.flatMap((performer) =>
      LIMBS.map((_, limb) => (performer.group.visible ? performer.handle(limb, new Vector3()) : null)),
    );
  }

  /** Size relative to the standard figure that the audience's camera has to show: that of the tallest performer. */
  get tallestScale(): number {
    return Math.max(...this.#performers.map(({ height }) => height / STANDING_HEIGHT_M));
  }

  /** Return boxes that contain the visible performers in the picture, in CSS pixels. */
  boxes(projection: ScreenProjection): ScreenBox[] {
    return this.visiblePerformers.flatMap(({ joint, scale, height }) => {
      // A large head reaches further up.
      const up = CLOTHES_EXTENT.up + Math.max(0, height / scale - STANDING_HEIGHT_M);
      return [MIDDLE_JOINT, ...OUTER_JOINTS].map((name) =>
        projection.boxAt(
          at.setFromMatrixPosition(joint(name)),
          name === MIDDLE_JOINT ? TRUNK_EXTENT : { ...CLOTHES_EXTENT, up },
          scale,
        ),
      );
    });
  }

  /** Return the boxes of the visible performers' faces in the picture, in CSS pixels. */
  faceBoxes(projection: ScreenProjection, scale: number): ScreenBox[] {
    return this.visiblePerformers.map(({ joint }) =>
      projection.boxAt(at.setFromMatrixPosition(joint("skullbase")), FACE_EXTENT, scale),
    );
  }

  /**
   * Set one performer per figure. Return whether the existing performers were replaced; false if others at most joined.
   */
  setFigures(figures: readonly Figure[]): boolean {
    const isUnchanged = this.#performers.length > 0 && this.#performers.every(({ figure }, k) => figure === figures[k]);
    if (!isUnchanged) for (const performer of this.#performers.splice(0)) performer.dispose();
    for (let k = this.#performers.length; k < figures.length; k++)
      this.#performers.push(this.#createPerformer(figures[k], k));
    this.#assets?.retainOnly(figures);
    return !isUnchanged;
  }

  /** Set the factory of a performer (an index), for this and later motions; null restores the puppet. */
  setPerformerFactory(factory: PerformerFactory | null, performer = 0): void {
    this.#factories[performer] = factory;
    const before = this.#performers[performer];
    if (!before) return;
    before.dispose();
    this.#performers[performer] = this.#createPerformer(before.figure, performer);
  }

  /**
   * Apply one pose per performer; without one it keeps its last. `seconds` advances the swing of loose parts and
   * blinks; 0 stops them. `clock` is the clock time of the poses in microseconds; null without blinks.
   */
  apply(poses: readonly (StagedPose | null)[], seconds: number, clock: number | null = null): void {
    if (!this.#blinks && clock !== null) this.#loadBlinks(seconds);
    this.#performers.forEach((performer, k) => {
      const pose = poses[k];
      if (!pose) return;
      performer.group.visible = true;
      performer.apply(pose, seconds, this.#blinks?.update(k, pose, (clock ?? 0) / 1e6, clock === null ? 0 : seconds));
    });
  }

  /** Set reflections and simple materials, also for performers that join later. */
  setQuality(showsReflection: boolean, usesSimpleMaterials: boolean): void {
    [this.#showsReflection, this.#usesSimpleMaterials] = [showsReflection, usesSimpleMaterials];
    for (const performer of this.#performers) this.#applyQuality(performer);
  }

  /** Draw what the next frame needs beforehand. World matrices are up to date. */
  prepare(renderer: WebGLRenderer, scene: Scene, camera: Camera, look: Look): void {
    for (const performer of this.visiblePerformers) performer.prepare?.(renderer, scene, camera, look);
  }

  /** Draw again what `prepare` has drawn: the graphics context was lost. */
  invalidate(): void {
    for (const performer of this.#performers) performer.invalidate?.();
  }

  dispose(): void {
    for (const performer of this.#performers.splice(0)) performer.dispose();
    this.#assets?.dispose();
  }

  /** Load blinks some time after the first frame. */
  #loadBlinks(seconds: number): void {
    const before = this.#movedS;
    this.#movedS += seconds;
    // Without them, performers stare.
    if (before <= BLINK_DELAY_S && this.#movedS > BLINK_DELAY_S)
      void import("./face/auto-blink").then(
        ({ AutoBlink }) => (this.#blinks = new AutoBlink()),
        () => {},
      );
  }

  #createPerformer(figure: Figure, number: number): Performer {
    const performer = this.#factories[number]?.(figure) ?? this.#createPuppet(figure);
    this.#applyQuality(performer);
    performer.group.visible = false;
    this.group.add(performer.group);
    return performer;
  }

  #createPuppet(figure: Figure): Puppet {
    this.#assets ??= new PuppetAssets({ face: createFaceTexture(), asanoha: createAsanohaTexture() }, this.floorHeight);
    return new Puppet(figure, this.#assets, this.#usesSimpleMaterials);
  }

  #applyQuality(performer: Performer): void {
    performer.showsReflection = this.#showsReflection;
    performer.usesSimpleMaterials = this.#usesSimpleMaterials;
  }
}
