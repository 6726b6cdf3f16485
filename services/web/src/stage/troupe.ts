/** Who is on the stage: for each dancer of the motion a puppet, or an avatar in its place. */
import { Group, type IUniform } from "three";
import type { Figure, Pose } from "../motion/skeleton";
import { asanohaTexture, faceTexture } from "./paint";
import type { Performer } from "./performer";
import { Puppet } from "./puppet";
import { Workshop } from "./workshop";

/** Makes who dances for the lengths of the dancer that the stream tells of. */
export type MakePerformer = (figure: Figure) => Performer;

export class Troupe {
  readonly group = new Group();
  readonly #performers: Performer[] = [];
  /** By number of the performer; none for a puppet. */
  readonly #makes: (MakePerformer | null)[] = [];
  #workshop: Workshop | null = null;
  #reflected = false;
  #plain = false;

  /** `floorAt` holds the height of the floor that reflects. */
  constructor(private readonly floorAt: IUniform<number>) {
    this.group.name = "troupe";
  }

  /** All who dance, in the order of the motion's tracks. */
  get performers(): readonly Performer[] {
    return this.#performers;
  }

  /** Those of whom there was a pose. */
  get shown(): readonly Performer[] {
    return this.#performers.filter(({ group }) => group.visible);
  }

  /** Comes on, a performer for each of the dancers' lengths. Returns whether they are others than before; false where more joined at most. */
  enter(figures: readonly Figure[]): boolean {
    const stay = this.#performers.length > 0 && this.#performers.every(({ figure }, k) => figure === figures[k]);
    if (!stay) for (const performer of this.#performers.splice(0)) performer.dispose();
    for (let k = this.#performers.length; k < figures.length; k++) this.#performers.push(this.#cast(figures[k], k));
    this.#workshop?.keep(figures);
    return !stay;
  }

  /** Has the dance of a performer, by number, danced by whom `make` makes, from now on and in every motion; null: by the puppet. */
  danceBy(make: MakePerformer | null, performer = 0): void {
    this.#makes[performer] = make;
    const before = this.#performers[performer];
    if (!before) return;
    before.dispose();
    this.#performers[performer] = this.#cast(before.figure, performer);
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
  furnish(reflected: boolean, plain: boolean): void {
    [this.#reflected, this.#plain] = [reflected, plain];
    for (const performer of this.#performers) this.#dress(performer);
  }

  dispose(): void {
    for (const performer of this.#performers.splice(0)) performer.dispose();
    this.#workshop?.dispose();
  }

  #cast(figure: Figure, number: number): Performer {
    const performer = this.#makes[number]?.(figure) ?? this.#carve(figure);
    this.#dress(performer);
    performer.group.visible = false;
    this.group.add(performer.group);
    return performer;
  }

  #carve(figure: Figure): Puppet {
    this.#workshop ??= new Workshop({ face: faceTexture(), asanoha: asanohaTexture() }, this.floorAt);
    return new Puppet(figure, this.#workshop);
  }

  #dress(performer: Performer): void {
    performer.reflected = this.#reflected;
    performer.plain = this.#plain;
  }
}
