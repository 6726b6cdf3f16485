/** Who holds what, who asks for it, and what is done about it: between the session's word, one's own hands, and the page. */

import { pageTranslator } from "../i18n/translator";
import type { HoldSource, LimbController } from "../input/limb-controller";
import { type Command, controlsOf, isPadControl, type Mapping } from "../input/mapping";
import { PerformerSelection } from "../input/performer-selection";
import type { VelocityInputs } from "../input/velocity-input";
import { type LimbState, limbHolders, limbName, limbRequesters, limbsInKeyOrder } from "../ui/limb-state";
import { controlName } from "../ui/mapping/control-name";
import type { ShowToast } from "../ui/notification/toast";
import type { Page } from "../ui/page";
import { limbNumber } from "../wire/limbs";
import type { Playback } from "./playback";

/** What stands on the stage's chunk, and comes after the page. */
export interface StageInputs {
  hands: LimbController;
  velocity: VelocityInputs;
  /** The ring of a limb shakes. */
  shakeRing(limb: number): void;
}

/** Where it is shown: the page, or as much of one as there is. */
export interface LimbControllerView {
  readonly toast: ShowToast;
  readonly strings: Pick<Page["strings"], "render" | "notice">;
  readonly limbRequests: Page["limbRequests"];
  readonly library?: { readonly danceAs: Pick<Page["library"]["danceAs"], "dancers"> };
}

export class ClaimController {
  stageInputs: StageInputs | null = null;
  connected = false;
  /** Whether this page only watches: nothing can be taken. */
  viewOnly = false;
  /** Whose strings keys, pad and page act on. */
  readonly selectedPerformer = new PerformerSelection(() => this.render());
  #playback: Playback | null = null;
  /** The limb that was reached for in vain: what "ask" asks for. */
  #contestedLimb: number | null = null;

  constructor(
    private readonly view: LimbControllerView,
    private readonly getMapping: () => Mapping,
    private readonly translator = pageTranslator,
  ) {}

  /** The session it is about from now on. */
  setPlayback(playback: Playback): void {
    this.#playback = playback;
    this.#contestedLimb = null;
    const { viewer, puppeteer } = playback;
    if (this.stageInputs) this.stageInputs.hands.puppeteer = puppeteer;
    const on = <T>(name: string, told: (detail: T) => void) =>
      puppeteer.addEventListener(name, (event) => told((event as CustomEvent<T>).detail));
    const render = () => this.render();
    const count = () => {
      this.selectedPerformer.count = Math.max(1, viewer.performers.length);
      // those of who is on the stage no more
      this.stageInputs?.hands.releaseAll(limbNumber(this.selectedPerformer.count, 0));
    };
    count();
    viewer.addEventListener("figure", count);
    viewer.addEventListener("tracks", count);
    viewer.addEventListener("presence", render);
    on("welcome", render);
    on("presence", render);
    on<{ limb: number }>("refusal", ({ limb }) => {
      this.stageInputs?.hands.onRefused(limb);
      this.onClaimRefused(limb);
    });
    on<{ limb: number; asked: boolean }>("grant", ({ limb, asked }) => {
      if (asked) this.#onLimbGranted(limb);
    });
    on<{ limb: number; free: boolean }>("lapsed", ({ limb, free }) => {
      this.view.toast(
        this.translator.translate(free ? "The {limb} is free now" : "The {limb} was not given", {
          limb: this.#limbName(limb),
        }),
      );
      this.render();
    });
    on<{ detail: string }>("notice", ({ detail }) =>
      this.view.strings.notice(this.translator.translateServerText(detail)),
    );
  }

  /** The limbs of all performers as the session says, and one's own at once, before it has answered. */
  limbStates(): LimbState[] {
    const { puppeteer, viewer } = this.#playback ?? {};
    const { hands, velocity } = this.stageInputs ?? {};
    const who = [
      viewer?.presence ?? null,
      puppeteer?.id ?? null,
      this.selectedPerformer.count,
      this.translator,
    ] as const;
    const told = limbHolders(...who);
    const asking = limbRequesters(...who);
    return told.map((one, limb) => {
      const mine = Boolean(hands?.source(limb));
      const holder = mine
        ? { id: puppeteer?.id ?? "", name: this.translator.translate("You"), colour: puppeteer?.colour ?? 0, mine }
        : one?.mine
          ? null
          : one;
      return {
        holder,
        requesters: asking[limb],
        requestedByMe: puppeteer?.isAsking(limb) ?? false,
        selected: velocity?.selectedLimb === limb && velocity.holds(limb),
      };
    });
  }

  isFree(limb: number): boolean {
    const state = this.limbStates()[limb];
    return !this.viewOnly && state !== undefined && !state.holder;
  }

  render(): void {
    const limbs = this.limbStates();
    this.view.strings.render(
      limbs,
      this.connected && this.#playback !== null && !this.viewOnly,
      this.selectedPerformer.performer,
    );
    this.view.limbRequests.render(limbs, this.#keyHint("give"));
    this.view.library?.danceAs.dancers(limbs, this.selectedPerformer.performer);
  }

  /** Turns to the next performer, by a key or button: it is said, as what is seen of it is little. */
  selectNextPerformer(): void {
    const { selectedPerformer: chosen } = this;
    if (chosen.count < 2) return;
    chosen.select((chosen.performer + 1) % chosen.count);
    this.view.toast(
      this.translator.translate("Dancer {number} of {count}", { number: chosen.performer + 1, count: chosen.count }),
    );
  }

  /** Takes a limb if it is free; if not, says who has it. */
  claim(limb: number, source: HoldSource): boolean {
    if (!this.isFree(limb) && !this.stageInputs?.hands.source(limb)) {
      this.onClaimRefused(limb);
      return false;
    }
    return this.stageInputs?.hands.claim(limb, source) ?? false;
  }

  /** The page's button of a limb: takes it, or lets it go. */
  toggleClaim(limb: number): void {
    if (this.viewOnly) return;
    const { hands, velocity } = this.stageInputs ?? {};
    if (hands?.source(limb)) hands.release(limb);
    else velocity?.hold(limb);
  }

  /** A limb that was reached for is another's. */
  onClaimRefused(limb: number): void {
    const state = this.limbStates()[limb];
    if (this.viewOnly || !state) return;
    this.stageInputs?.shakeRing(limb);
    const { holder, requestedByMe: asked } = state;
    const name = this.#limbName(limb);
    if (!holder || holder.mine) {
      this.view.toast(this.translator.translate("The {limb} was let go", { limb: name }));
    } else if (asked) {
      this.view.toast(this.translator.translate("You ask {name} for the {limb}", { name: holder.name, limb: name }));
    } else {
      this.#contestedLimb = limb;
      this.view.toast(this.translator.translate("{name} holds the {limb}", { name: holder.name, limb: name }), {
        label: this.translator.translate("Ask"),
        key: this.#keyHint("ask"),
        run: () => this.requestLimb(limb),
      });
    }
  }

  /** Asks the holder for a limb; without one, for that which was reached for last. */
  requestLimb(limb = this.#contestedLimb): void {
    if (this.viewOnly) return;
    const holder = limb === null ? null : this.limbStates()[limb]?.holder;
    if (limb === null || !holder || holder.mine) {
      this.view.toast(this.translator.translate("Reach for a string that another holds, then ask for it"));
      return;
    }
    this.#contestedLimb = null;
    this.#playback?.puppeteer.ask(limb);
    this.view.toast(
      this.#playback?.puppeteer.isAsking(limb)
        ? this.translator.translate("You ask {name} for the {limb}", { name: holder.name, limb: this.#limbName(limb) })
        : this.translator.translate("The line is lost; ask again when it is back"),
    );
    this.render();
  }

  withdrawRequest(limb: number): void {
    this.#playback?.puppeteer.cancelAsk(limb);
    this.render();
  }

  /** Gives a limb to the first who asks for it; without one, the selected limb if it is asked for, else any that is. */
  handOver(limb = this.#nextRequestedLimb()): void {
    if (this.viewOnly) return;
    if (limb === null) this.view.toast(this.translator.translate("Nobody asks for a string of yours"));
    else this.stageInputs?.hands.release(limb);
  }

  #nextRequestedLimb(): number | null {
    const limbs = this.limbStates();
    const asked = limbsInKeyOrder(this.selectedPerformer.count).filter(
      (limb) => limbs[limb].holder?.mine && limbs[limb].requesters.length > 0,
    );
    return asked.find((limb) => limbs[limb].selected) ?? asked[0] ?? null;
  }

  #onLimbGranted(limb: number): void {
    const { hands, velocity } = this.stageInputs ?? {};
    if (!hands?.claim(limb, "velocity")) {
      this.#playback?.puppeteer.release(limb);
      return;
    }
    velocity?.hold(limb);
    this.view.toast(this.translator.translate("The {limb} is yours", { limb: this.#limbName(limb) }));
    this.render();
  }

  #limbName(limb: number): string {
    return limbName(limb, this.selectedPerformer.count, this.translator);
  }

  #keyHint(command: Command): string | null {
    const control = controlsOf(this.getMapping(), command).find((one) => !isPadControl(one));
    return control === undefined ? null : controlName(control, this.translator);
  }
}
