/** What is on the stage, frame by frame: the dance of the room, who holds its strings, and one's own hands by pointer and keys. */

import { CommandDispatcher, type PageActions } from "../input/command-dispatcher";
import { LimbController } from "../input/limb-controller";
import type { Mapping } from "../input/mapping";
import { createPointerInput, type PointerInput } from "../input/pointer";
import { VelocityInputs } from "../input/velocity-input";
import type { Pose } from "../motion/skeleton";
import type { Graphics } from "../stage/rendering/graphics";
import { Stage } from "../stage/stage";
import type { StringState } from "../stage/strings/strings";
import type { LimbState } from "../ui/limb-state";
import { performerOfLimb } from "../wire/limbs";
import type { ClaimController } from "./claim-controller";
import type { Playback } from "./playback";

export interface StageControllerOptions {
  getMapping: () => Mapping;
  /** What keys and pad do beside taking limbs. */
  actions: PageActions;
  /** Told whenever what is held here changes. */
  onClaimsChange: () => void;
  /** The canvas's, where they are open already. */
  graphics?: Graphics;
}

/** The rings of who is turned to light up for so long, milliseconds. */
const RING_HIGHLIGHT_MS = 900;

/** What one frame showed. */
export interface FrameState {
  /** The first performer's, null before there is any. */
  pose: Pose | null;
  limbs: readonly LimbState[];
}

export class StageController {
  readonly stage: Stage;
  readonly hands: LimbController;
  readonly pointer: PointerInput;
  readonly velocity: VelocityInputs;
  readonly commands: CommandDispatcher;
  #playback: Playback | null = null;
  #lastDrawMs = 0;
  /** The performer that was turned to, whose rings light up until then. */
  #ringHighlight = { to: 0, until: 0 };

  /** Draws on `canvas`; `holding` is about its hands from now on. Throws where the browser has no WebGL 2. */
  constructor(
    canvas: HTMLCanvasElement,
    private readonly limbController: ClaimController,
    { getMapping: mapping, actions, onClaimsChange: changed, graphics }: StageControllerOptions,
  ) {
    this.stage = new Stage(canvas, graphics);
    this.hands = new LimbController(this.stage);
    this.hands.onChange = changed;
    const free = (limb: number) => limbController.isFree(limb);
    const { selectedPerformer: chosen } = limbController;
    this.velocity = new VelocityInputs(this.hands, {
      claim: (limb) => limbController.claim(limb, "velocity"),
      isFree: free,
      selection: chosen,
    });
    this.pointer = createPointerInput(canvas, this.stage, this.hands, {
      canClaim: free,
      onRefused: (limb) => limbController.onClaimRefused(limb),
      onClaimed: (limb) => chosen.select(performerOfLimb(limb)),
      smoothing: () => mapping().pointerSmoothing,
      depthInput: (limb) => this.velocity.depthInput(limb),
    });
    this.commands = new CommandDispatcher(this.hands, this.velocity, actions);
    limbController.stageInputs = {
      hands: this.hands,
      velocity: this.velocity,
      shakeRing: (limb) => this.stage.strings.shakeRing(limb),
    };
  }

  /** The room it is about from now on: its dancers come on, if any are there already. With none the last ones stand still. */
  setPlayback(playback: Playback | null): void {
    this.#playback = playback;
    this.hands.puppeteer = playback?.puppeteer ?? null;
    this.updatePerformers();
  }

  /** The room's dancers come on, as far as they are known. */
  updatePerformers(): void {
    const { performers = [], figure, front } = this.#playback?.viewer ?? {};
    // one that cannot be read keeps its place, and is never seen
    if (figure)
      this.stage.setFigures(
        performers.map((one) => one?.figure ?? figure),
        front,
      );
  }

  /** Moves everything on to local `now`, milliseconds, and draws it; `focused` is a limb whose control has the focus. */
  draw(now: number, focusedLimb: number | null = null): FrameState {
    const { limbController: holding, hands, pointer, stage, velocity } = this;
    const viewer = this.#playback?.viewer;
    const seconds = (now - this.#lastDrawMs) / 1000;
    this.#lastDrawMs = now;
    pointer.update(now);
    velocity.update(now);
    const poses = viewer?.performers.map((_, performer) => viewer.poseAt(now, performer)) ?? [];
    const limbs = holding.limbStates();
    const { selectedPerformer: chosen } = holding;
    if (chosen.performer !== this.#ringHighlight.to)
      this.#ringHighlight = { to: chosen.performer, until: chosen.count > 1 ? now + RING_HIGHLIGHT_MS : 0 };
    const states = limbs.map(({ holder, selected }, limb): StringState => {
      const own = performerOfLimb(limb) === chosen.performer;
      return {
        puppeteer: holder?.colour ?? null,
        isHighlighted:
          pointer.hoveredLimb === limb || focusedLimb === limb || selected || (own && now < this.#ringHighlight.until),
        pullTarget: hands.pullTarget(limb),
        isDimmed: !own,
      };
    });
    // under a finger that pulls the picture stays where it is
    if (!pointer.isDragging) stage.selectedPerformer = holding.viewOnly ? null : chosen.performer;
    stage.draw(poses, states, seconds, viewer?.cameraAt(now), viewer?.lightsAt(now), viewer?.presentationTime(now));
    return { pose: poses[0] ?? null, limbs };
  }

  /** Lets go what was pressed, as nobody would let it up: the page is hidden. */
  releaseInputs(): void {
    this.commands.releaseAll();
    this.velocity.update(performance.now());
  }
}
