/** Controls of limbs on the page: keys, gamepad, buttons and panels act on limbs that are in the engine. */
import type { ClaimState } from "../engine/claim-controller";
import type { EngineCommand, LimbAction } from "../engine/message";
import type { BodyMessage } from "../input/body-input";
import type { PageActions } from "../input/command-dispatcher";
import type { PageAction } from "../input/mapping";
import { RemoteCommands } from "../input/remote-commands";

export class LimbControls {
  readonly commands: RemoteCommands;
  /** True once the engine handles commands. */
  isReady = false;
  /** Performer whose limbs keys, gamepad and page controls act on. */
  performer = 0;
  #isLimbSelected = false;
  #holdsLimb = false;

  constructor(
    private readonly send: (command: EngineCommand) => void,
    private readonly actions: PageActions,
  ) {
    this.commands = new RemoteCommands({
      actions,
      isReady: () => this.isReady,
      isLimbSelected: () => this.#isLimbSelected,
      send,
    });
  }

  /** Act on a limb, by default on the one that the action refers to. */
  act(action: LimbAction, limb: number | null = null): void {
    this.send({ type: "limb", action, limb });
  }

  /** Set the limb whose control has the focus. */
  focus(limb: number | null): void {
    this.send({ type: "set", settings: { focusedLimb: limb } });
  }

  selectPerformer(performer: number | "next"): void {
    this.send({ type: "performer", performer });
  }

  /** Move the hands of the selected performer by those before the camera. */
  moveBody(hands: BodyMessage, now: number): void {
    this.send({ type: "body", hands, now });
  }

  /** Run the action of a pressed control that the engine left to the page, as no limb is selected. */
  run(action: PageAction): void {
    this.actions[action]();
  }

  /** Release all limbs held by keys, gamepad, buttons or camera. Return whether the page knows of any. */
  releaseAll(): boolean {
    // Sent in any case: the engine may have claimed a limb that it has not reported yet.
    this.send({ type: "release limbs" });
    return this.#holdsLimb;
  }

  /** Follow the claims of this page, which change as soon as the engine has handled an input. */
  update({ performer, selectedLimb, holdsLimb }: Pick<ClaimState, "performer" | "selectedLimb" | "holdsLimb">): void {
    this.performer = performer;
    this.#isLimbSelected = selectedLimb !== null;
    this.#holdsLimb = holdsLimb;
  }
}
