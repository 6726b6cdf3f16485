/** Who is on the stage: for each dancer of the motion a puppet, or an avatar in its place. */
import { Group, type IUniform } from "three";
import type { Figure, Pose } from "../../motion/skeleton";
import type { Performer } from "./performer";
import { Puppet } from "./puppet";
import { PuppetAssets } from "./puppet-assets";
import { createAsanohaTexture, createFaceTexture } from "./texture";

/** Makes who dances for the lengths of the dancer that the stream tells of. */
export type PerformerFactory = (figure: Figure) => Performer;

export class PerformerGroup {
  readonly group = new Group();
  readonly #performers: Performer[] = [];
  /** By number of the performer; none for a puppet. */
  readonly #factories: (PerformerFactory | null)[] = [];
  #assets: PuppetAssets | null = null;
  #showsReflection = false;
  #usesSimpleMaterials = false;

  /** `floorAt` holds the height of the floor that reflects. */
  constructor(private readonly floorHeight: IUniform<number>) {
    this.group.name = "troupe";
  }

  /** All who dance, in the order of the motion's tracks. */
  get performers(): readonly Performer[] {
    return this.#performers;
  }

  /** Those of whom there was a pose. */
  get visiblePerformers(): readonly Performer[] {
    return this.#performers.filter(({ group }) => group.visible);
  }

  /** Comes on, a performer for each of the dancers' lengths. Returns whether they are others than before; false where more joined at most. */
  setFigures(figures: readonly Figure[]): boolean {
    const stay = this.#performers.length > 0 && this.#performers.every(({ figure }, k) => figure === figures[k]);
    if (!stay) for (const performer of this.#performers.splice(0)) performer.dispose();
    for (let k = this.#performers.length; k < figures.length; k++)
      this.#performers.push(this.#createPerformer(figures[k], k));
    this.#assets?.retainOnly(figures);
    return !stay;
  }

  /** Has the dance of a performer, by number, danced by whom `make` makes, from now on and in every motion; null: by the puppet. */
  setPerformerFactory(factory: PerformerFactory | null, performer = 0): void {
    this.#factories[performer] = factory;
    const before = this.#performers[performer];
    if (!before) return;
    before.dispose();
    this.#performers[performer] = this.#createPerformer(before.figure, performer);
  }

  /** Takes a pose for each; one without stands as it stood. `seconds` let what hangs loose swing, 0 sets it still. */
  apply(poses: readonly (Pose | null)[], seconds: number): void {
    this.#performers.forEach((performer, k) => {
      const pose = poses[k];
      if (!pose) return;
      performer.group.visible = true;
      performer.apply(pose, seconds);
    });
  }

  /** Shows reflections, and draws with plain materials, as of now for all who come on too. */
  setQuality(reflected: boolean, plain: boolean): void {
    [this.#showsReflection, this.#usesSimpleMaterials] = [reflected, plain];
    for (const performer of this.#performers) this.#applyQuality(performer);
  }

  dispose(): void {
    for (const performer of this.#performers.splice(0)) performer.dispose();
    this.#assets?.dispose();
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
    return new Puppet(figure, this.#assets);
  }

  #applyQuality(performer: Performer): void {
    performer.showsReflection = this.#showsReflection;
    performer.usesSimpleMaterials = this.#usesSimpleMaterials;
  }
}
