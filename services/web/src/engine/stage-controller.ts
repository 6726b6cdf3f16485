/**
 * Stage of a playback: draws poses and strings every frame, and connects pointer and key inputs to the limbs. It runs
 * in a worker or in the page.
 */
import type { BodyInput, BodyMessage } from "../input/body-input";
import { CommandDispatcher, type PageActions } from "../input/command-dispatcher";
import { LimbController } from "../input/limb-controller";
import type { Mapping } from "../input/mapping";
import { createPointerInput, type PointerInput } from "../input/pointer";
import { VelocityInputs } from "../input/velocity-input";
import type { Figure, Pose } from "../motion/skeleton";
import type { LightState } from "../playout/light-state";
import type { StageCanvas } from "../stage/rendering/canvas";
import type { Graphics } from "../stage/rendering/graphics";
import { Stage } from "../stage/stage";
import type { StringState } from "../stage/strings/strings";
import type { LimbState } from "../ui/limb-state";
import { CROWD, performerOfLimb } from "../wire/limbs";
import type { PropPresence } from "../wire/messages";
import type { ClaimController } from "./claim-controller";
import type { Playback } from "./playback";

export interface StageControllerOptions {
  getMapping: () => Mapping;
  /** Actions of keys and gamepad other than claiming and moving limbs. */
  actions: PageActions;
  /** Called whenever the set of limbs that this page holds changes. */
  onClaimsChange: () => void;
  /** Graphics of the canvas, if they were opened already. */
  graphics?: Graphics;
  /** Leave out the backdrop and the floor, so that what is behind the canvas is seen. */
  isTransparent?: boolean;
  /** Show the rings by which limbs are taken; true by default. */
  showsHandles?: boolean;
  /** Camera in place of the motion's, as its seven numbers. */
  camera?: ArrayLike<number> | null;
}

/** Time for which the rings of a newly selected performer are highlighted. */
const RING_HIGHLIGHT_MS = 900;

/** Content of one frame. */
export interface FrameState {
  /** Pose of the first performer; null before the first block arrived. */
  pose: Pose | null;
  limbs: readonly LimbState[];
}

/** What the stage shows at one instant. */
export interface StageContent {
  poses: readonly (Pose | null)[];
  limbs: readonly LimbState[];
  strings: readonly StringState[];
  lights: readonly LightState[];
  props: readonly PropPresence[];
  /** Seconds since the last one. */
  seconds: number;
}

export class StageController {
  readonly stage: Stage;
  readonly hands: LimbController;
  readonly pointer: PointerInput;
  readonly velocity: VelocityInputs;
  readonly commands: CommandDispatcher;
  readonly #camera: ArrayLike<number> | null;
  #playback: Playback | null = null;
  /** Hands before the camera, whose code is loaded with the first of them. */
  #body: Promise<BodyInput> | null = null;
  #lastDrawMs = 0;
  /** Figures of the performers, other ones after each change, and the turn to the front of the first. */
  figures: readonly Figure[] = [];
  front = 0;
  /** Last selected performer, and the time in milliseconds until which its rings are highlighted. */
  #ringHighlight = { performer: 0, until: 0 };

  /** Draw on `canvas`, and connect its inputs to `limbController`. Throws if the browser has no WebGL 2. */
  constructor(
    canvas: StageCanvas,
    private readonly limbController: ClaimController,
    options: StageControllerOptions,
  ) {
    const {
      getMapping,
      actions,
      onClaimsChange,
      graphics,
      isTransparent,
      showsHandles = true,
      camera = null,
    } = options;
    this.stage = new Stage(canvas, graphics, isTransparent);
    this.stage.strings.showsHandles = showsHandles;
    this.#camera = camera;
    this.hands = new LimbController(this.stage);
    this.hands.onChange = onClaimsChange;
    const canPull = (limb: number) => limbController.canPull(limb);
    const { selectedPerformer: selection } = limbController;
    this.velocity = new VelocityInputs(this.hands, {
      claim: (limb) => limbController.claim(limb, "velocity"),
      isFree: canPull,
      selection,
    });
    this.pointer = createPointerInput(this.stage, this.hands, {
      canClaim: canPull,
      onRefused: (limb) => limbController.onClaimRefused(limb),
      onClaimed: (limb) => selection.select(performerOfLimb(limb)),
      smoothing: () => getMapping().pointerSmoothing,
      depthInput: (limb) => this.velocity.depthInput(limb),
    });
    this.commands = new CommandDispatcher(this.hands, this.velocity, actions);
    limbController.stageInputs = {
      hands: this.hands,
      velocity: this.velocity,
      shakeRing: (limb) => this.stage.strings.shakeRing(limb),
    };
  }

  /** Performer whose limbs keys, gamepad and page controls act on. */
  get selectedPerformer(): number {
    return this.limbController.selectedPerformer.performer;
  }

  /** Show another playback. With null, the last performers stay on the stage and stand still. */
  setPlayback(playback: Playback | null): void {
    this.#playback = playback;
    this.hands.crowdMember = playback?.viewer ?? null;
    this.hands.puppeteer = playback?.puppeteer ?? null;
    this.#body = null;
    if (playback) this.stage.access = playback.access;
    this.updatePerformers();
  }

  /** Show the performers of the playback, as far as their skeletons were received. */
  updatePerformers(): void {
    const { performers = [], figure, front = 0 } = this.#playback?.viewer ?? {};
    if (!figure) return;
    // A performer whose track cannot be decoded keeps its index, and is never drawn.
    this.figures = performers.map((performer) => performer?.figure ?? figure);
    this.front = front;
    this.stage.setFigures(this.figures, front);
  }

  /** Follow the hands before the camera; null releases them. `now` is in milliseconds. */
  async moveHands(hands: BodyMessage | null, now: number): Promise<void> {
    if (!hands && !this.#body) return;
    this.#body ??= import("../input/body-input").then(
      ({ BodyInput }) => new BodyInput(this.hands, this.limbController, this.stage),
    );
    (await this.#body).handle(hands, now);
  }

  /** Draw the frame of local time `now` in milliseconds. `focusedLimb` is the limb whose control has the focus. */
  draw(now: number, focusedLimb: number | null = null): FrameState {
    const { limbController, pointer, stage } = this;
    const viewer = this.#playback?.viewer;
    pointer.update(now);
    const { poses, limbs, strings, lights, props, seconds } = this.advance(now, [focusedLimb]);
    stage.props = props;
    // The camera must not move under a finger that drags a limb.
    if (!pointer.isDragging) stage.selectedPerformer = limbController.viewOnly ? null : this.selectedPerformer;
    const camera = this.#camera ?? viewer?.cameraAt(now);
    stage.draw(poses, strings, seconds, camera, lights, viewer?.presentationTime(now));
    return { pose: poses[0] ?? null, limbs };
  }

  /**
   * Advance limbs that move by velocity, and return the content of the stage at local time `now` in milliseconds.
   * `highlightedLimbs` are highlighted in addition to those of pointer and selection.
   */
  advance(now: number, highlightedLimbs: readonly (number | null)[] = []): StageContent {
    const { hands, limbController, pointer, velocity } = this;
    const viewer = this.#playback?.viewer;
    const seconds = (now - this.#lastDrawMs) / 1000;
    this.#lastDrawMs = now;
    velocity.update(now);
    const poses = viewer?.performers.map((_, performer) => viewer.poseAt(now, performer)) ?? [];
    const limbs = limbController.limbStates();
    const { selectedPerformer: selection } = limbController;
    if (selection.performer !== this.#ringHighlight.performer)
      this.#ringHighlight = {
        performer: selection.performer,
        until: selection.count > 1 ? now + RING_HIGHLIGHT_MS : 0,
      };
    const strings = limbs.map(({ holder, selected }, limb): StringState => {
      const isSelected = performerOfLimb(limb) === selection.performer;
      return {
        puppeteer: holder && holder.id !== CROWD ? holder.colour : null,
        isOpen: hands.isOpen(limb),
        crowdThreads: hands.crowdThreads(limb, viewer?.crowdPulls.get(limb)?.places ?? []),
        isHighlighted:
          pointer.hoveredLimb === limb ||
          highlightedLimbs.includes(limb) ||
          selected ||
          (isSelected && now < this.#ringHighlight.until),
        pullTarget: hands.pullTarget(limb),
        isDimmed: !isSelected,
      };
    });
    return {
      poses,
      limbs,
      strings,
      lights: viewer?.lightsAt(now) ?? [],
      props: viewer?.propsAt(now) ?? [],
      seconds,
    };
  }

  /**
   * Release all pressed keys and buttons. Called when the page goes into the background and receives no key-up events.
   */
  releaseInputs(): void {
    this.commands.releaseAll();
    this.velocity.update(performance.now());
  }
}
