/** What is on the stage, frame by frame: the dance of the room, who holds its strings, and one's own hands by pointer and keys. */
import type { Pose } from "./motion/skeleton";
import { performerOf } from "./wire/limbs";
import type { Holding } from "./holding";
import { Commands, type PageActions } from "./input/commands";
import { Hands } from "./input/hands";
import type { Mapping } from "./input/mapping";
import { createPointer, type PointerInput } from "./input/pointer";
import { VelocityInputs } from "./input/velocity";
import type { LimbState } from "./page/model";
import type { Room } from "./room";
import type { Graphics } from "./stage/graphics";
import { Stage } from "./stage/stage";
import type { StringState } from "./stage/strings";

export interface PerformingOptions {
  mapping: () => Mapping;
  /** What keys and pad do beside taking limbs. */
  actions: PageActions;
  /** Told whenever what is held here changes. */
  changed: () => void;
  /** The canvas's, where they are open already. */
  graphics?: Graphics;
}

/** The rings of who is turned to light up for so long, milliseconds. */
const SHOWN = 900;

/** What one frame showed. */
export interface Shown {
  /** The first performer's, null before there is any. */
  pose: Pose | null;
  limbs: readonly LimbState[];
}

export class Performing {
  readonly stage: Stage;
  readonly hands: Hands;
  readonly pointer: PointerInput;
  readonly velocity: VelocityInputs;
  readonly commands: Commands;
  #room: Room | null = null;
  #drawnAt = 0;
  /** The performer that was turned to, whose rings light up until then. */
  #turned = { to: 0, until: 0 };

  /** Draws on `canvas`; `holding` is about its hands from now on. Throws where the browser has no WebGL 2. */
  constructor(canvas: HTMLCanvasElement, private readonly holding: Holding, { mapping, actions, changed, graphics }: PerformingOptions) {
    this.stage = new Stage(canvas, graphics);
    this.hands = new Hands(this.stage);
    this.hands.changed = changed;
    const free = (limb: number) => holding.free(limb);
    const { chosen } = holding;
    this.velocity = new VelocityInputs(this.hands, { take: (limb) => holding.take(limb, "velocity"), free, chosen });
    this.pointer = createPointer(canvas, this.stage, this.hands, {
      may: free, refused: (limb) => holding.refused(limb), taken: (limb) => chosen.choose(performerOf(limb)), smoothing: () => mapping().pointerSmoothing, nearer: (limb) => this.velocity.nearer(limb),
    });
    this.commands = new Commands(this.hands, this.velocity, actions);
    holding.theatre = { hands: this.hands, velocity: this.velocity, shake: (limb) => this.stage.strings.refuse(limb) };
  }

  /** The room it is about from now on: its dancers come on, if any are there already. With none the last ones stand still. */
  enter(room: Room | null): void {
    this.#room = room;
    this.hands.puppeteer = room?.puppeteer ?? null;
    this.comeOn();
  }

  /** The room's dancers come on, as far as they are known. */
  comeOn(): void {
    const { performers = [], figure, front } = this.#room?.viewer ?? {};
    // one that cannot be read keeps its place, and is never seen
    if (figure) this.stage.setFigures(performers.map((one) => one?.figure ?? figure), front);
  }

  /** Moves everything on to local `now`, milliseconds, and draws it; `focused` is a limb whose control has the focus. */
  draw(now: number, focused: number | null = null): Shown {
    const { holding, hands, pointer, stage, velocity } = this;
    const viewer = this.#room?.viewer;
    const seconds = (now - this.#drawnAt) / 1000;
    this.#drawnAt = now;
    pointer.update(now);
    velocity.update(now);
    const poses = viewer?.performers.map((_, performer) => viewer.poseAt(now, performer)) ?? [];
    const limbs = holding.limbs();
    const { chosen } = holding;
    if (chosen.performer !== this.#turned.to) this.#turned = { to: chosen.performer, until: chosen.count > 1 ? now + SHOWN : 0 };
    const states = limbs.map(({ holder, selected }, limb): StringState => {
      const own = performerOf(limb) === chosen.performer;
      return {
        holder: holder?.colour ?? null,
        lit: pointer.near === limb || focused === limb || selected || (own && now < this.#turned.until),
        pull: hands.pull(limb),
        behind: !own,
      };
    });
    // under a finger that pulls the picture stays where it is
    if (!pointer.pulling) stage.chosen = holding.watching ? null : chosen.performer;
    stage.draw(poses, states, seconds, viewer?.cameraAt(now), viewer?.lightsAt(now), viewer?.shownTime(now));
    return { pose: poses[0] ?? null, limbs };
  }

  /** Lets go what was pressed, as nobody would let it up: the page is hidden. */
  rest(): void {
    this.commands.forget();
    this.velocity.update(performance.now());
  }
}
