/**
 * Immersive session in the engine: applies the hands of the viewer to the limbs, and describes what the session shows.
 * It is loaded with the first session.
 */
import { HandInput, type HandState } from "../input/hand";
import type { Mapping } from "../input/mapping";
import type { Figure } from "../motion/skeleton";
import { performerOfLimb } from "../wire/limbs";
import type { ClaimController } from "./claim-controller";
import type { ImmersiveFrame } from "./message";
import type { StageController } from "./stage-controller";

export class ImmersiveController {
  readonly #hands: HandInput;
  /** Figures of the last frame; null before the first. */
  #figures: readonly Figure[] | null = null;

  /** `settings` are those of the page, which may change. */
  constructor(
    private readonly controller: StageController,
    private readonly claims: ClaimController,
    settings: { readonly mapping: Mapping },
  ) {
    this.#hands = new HandInput(controller.stage, controller.hands, {
      selectedPerformer: () => controller.selectedPerformer,
      isFree: (limb) => claims.canPull(limb),
      isHeldByOther: (limb) => claims.limbStates()[limb]?.holder?.mine === false && !claims.canPull(limb),
      onClaimed: (limb) => claims.selectedPerformer.select(performerOfLimb(limb)),
      ask: (limb) => claims.requestLimb(limb),
      isAsking: (limb) => claims.limbStates()[limb]?.requestedByMe ?? false,
      withdraw: (limb) => claims.withdrawRequest(limb),
      smoothing: () => settings.mapping.pointerSmoothing,
    });
  }

  /**
   * Apply the hands at local time `now` in milliseconds, and return what the session shows then. Null ends the session:
   * its hands let go of all strings, and there is nothing to show.
   */
  advance(now: number, hands: readonly HandState[] | null): ImmersiveFrame | null {
    const { claims, controller } = this;
    if (!hands) {
      this.#figures = null;
      this.#hands.releaseAll();
      return null;
    }
    const grips = claims.viewOnly ? [] : this.#hands.update(hands, now);
    const { poses, strings, lights, props, seconds } = controller.advance(now, this.#hands.limbsInReach);
    // Nothing is drawn here, but limbs are pulled in the frames of the performers' joints.
    controller.stage.performers.forEach((performer, k) => {
      const pose = poses[k];
      if (!pose) return;
      performer.group.visible = true;
      performer.apply(pose, seconds);
    });
    const { figures, front } = controller;
    const isUnchanged = figures === this.#figures;
    this.#figures = figures;
    return {
      figures: isUnchanged ? null : figures,
      front,
      poses,
      strings: strings.map((string) => ({ ...string, pullTarget: string.pullTarget?.toArray() ?? null })),
      lights,
      props,
      performer: controller.selectedPerformer,
      grips,
    };
  }
}
