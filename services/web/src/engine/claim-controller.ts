/** Claims of limbs: combines the session's state with this page's inputs, shows the result, and handles requests. */
import { pageTranslator } from "../i18n/translator";
import type { HoldSource, LimbController } from "../input/limb-controller";
import { type Command, controlsOf, isPadControl, type Mapping } from "../input/mapping";
import { PerformerSelection } from "../input/performer-selection";
import type { VelocityInputs } from "../input/velocity-input";
import { type LimbState, limbHolders, limbName, limbRequesters, limbsInKeyOrder } from "../ui/limb-state";
import { controlName } from "../ui/mapping/control-name";
import { isHand, limbNumber, limbWithinPerformer, performerOfLimb } from "../wire/limbs";
import type { Playback } from "./playback";

/** Inputs that the stage bundle provides, after the page was built. */
export interface StageInputs {
  hands: LimbController;
  velocity: VelocityInputs;
  /** Shake the ring of a limb, to show that it cannot be claimed. */
  shakeRing(limb: number): void;
}

/** Limbs of all performers as the controls show them. */
export interface ClaimState {
  readonly limbs: readonly LimbState[];
  /** True if limbs can be claimed now. */
  readonly isReady: boolean;
  /** Performer whose limbs keys, gamepad and page controls act on. */
  readonly performer: number;
  /** Name of the key that hands a limb over, if there is one. */
  readonly giveKey: string | null;
  /** Limb that inputs for "the held limb" move; null for none. */
  readonly selectedLimb: number | null;
  /** True if any limb is held by keys, gamepad or buttons, or pulled by a pointer. */
  readonly holdsLimb: boolean;
}

/** Offer to ask the holder of a limb for it. */
export interface AskOffer {
  readonly limb: number;
  readonly label: string;
  /** Name of the key that does the same, if there is one. */
  readonly key: string | null;
}

/** Display of the page, or of the embedded element. */
export interface ClaimView {
  render(state: ClaimState): void;
  /** Show a brief message, perhaps with the offer to ask for a limb. */
  toast(message: string, offer?: AskOffer): void;
  /** Show a notice of the session about an input. */
  notice(text: string): void;
}

export class ClaimController {
  connected = false;
  /** True if this page may not claim limbs. */
  viewOnly = false;
  /** Performer whose limbs keys, gamepad and page controls act on. */
  readonly selectedPerformer = new PerformerSelection(() => this.render());
  #stageInputs: StageInputs | null = null;
  #playback: Playback | null = null;
  /** Last limb whose claim failed: the one that a request without a limb asks for. */
  #contestedLimb: number | null = null;
  /** Bonds of this page's hands that were announced. */
  #announcedBonds: readonly string[] = [];

  constructor(
    private readonly view: ClaimView,
    private readonly getMapping: () => Mapping,
    private readonly translator = pageTranslator,
  ) {}

  /** Inputs of the stage. Before they are set no limb can be claimed. */
  set stageInputs(inputs: StageInputs) {
    this.#stageInputs = inputs;
    this.render();
  }

  /** Use another session from now on. */
  setPlayback(playback: Playback): void {
    this.#playback = playback;
    this.#contestedLimb = null;
    const { viewer, puppeteer } = playback;
    if (this.#stageInputs) {
      this.#stageInputs.hands.crowdMember = viewer;
      this.#stageInputs.hands.puppeteer = puppeteer;
    }
    const on = <T>(name: string, listener: (detail: T) => void) =>
      puppeteer.addEventListener(name, (event) => listener((event as CustomEvent<T>).detail));
    const render = () => this.render();
    const updateCount = () => {
      this.selectedPerformer.count = Math.max(1, viewer.performers.length);
      // Release the limbs of performers that left the stage.
      this.#stageInputs?.hands.releaseAll(limbNumber(this.selectedPerformer.count, 0));
    };
    updateCount();
    viewer.addEventListener("figure", updateCount);
    viewer.addEventListener("tracks", updateCount);
    viewer.addEventListener("presence", render);
    viewer.addEventListener("pulls", render);
    on("welcome", render);
    on("presence", render);
    on<{ limb: number }>("refusal", ({ limb }) => {
      this.#stageInputs?.hands.onRefused(limb);
      this.onClaimRefused(limb);
    });
    on<{ limb: number; asked: boolean }>("grant", ({ limb, asked }) => {
      if (asked) this.#onLimbGranted(limb);
    });
    on<{ limb: number; free: boolean }>("lapsed", ({ limb, free }) => {
      this.view.toast(
        this.translator.translate(free ? "The {limb} is free now" : "Your request for the {limb} was not granted", {
          limb: this.#limbName(limb),
        }),
      );
      this.render();
    });
    on<{ reason: string }>("bondend", ({ reason }) => this.view.toast(this.#describeBondEnd(reason)));
    on("presence", () => this.#announceBonds());
    on<{ detail: string }>("notice", ({ detail }) => this.view.notice(this.translator.translateServerText(detail)));
  }

  /** Return the state of all performers' limbs. Claims of this page are shown before the session confirms them. */
  limbStates(): LimbState[] {
    const { puppeteer, viewer } = this.#playback ?? {};
    const { hands, velocity } = this.#stageInputs ?? {};
    const context = [
      viewer?.presence ?? null,
      puppeteer?.id ?? null,
      this.selectedPerformer.count,
      this.translator,
    ] as const;
    const holders = limbHolders(...context);
    const requesters = limbRequesters(...context);
    const openLimbs = new Map((viewer?.presence?.crowd ?? []).map((open) => [open.limb, open]));
    return holders.map((sessionHolder, limb) => {
      const mine = Boolean(hands?.source(limb) && !hands.isCrowdPull(limb));
      const holder = mine
        ? { id: puppeteer?.id ?? "", name: this.translator.translate("You"), colour: puppeteer?.colour ?? 0, mine }
        : sessionHolder?.mine
          ? null
          : sessionHolder;
      const open = openLimbs.get(limb);
      return {
        holder,
        ...(open && {
          crowd: {
            policy: open.policy,
            pulls: open.pulls,
            votes: viewer?.crowdPulls.get(limb)?.votes ?? null,
            hasTurn: viewer?.crowdTurns.has(limb) ?? false,
            isPulled: hands?.isCrowdPull(limb) ?? false,
          },
        }),
        requesters: requesters[limb],
        requestedByMe: puppeteer?.isAsking(limb) ?? false,
        selected: velocity?.selectedLimb === limb && velocity.holds(limb),
      };
    });
  }

  isFree(limb: number): boolean {
    const state = this.limbStates()[limb];
    return !this.viewOnly && state !== undefined && !state.holder;
  }

  /** Return whether this page can pull a limb: it is free, or open to the crowd, for viewers too. */
  canPull(limb: number): boolean {
    return this.isFree(limb) || (this.connected && this.#stageInputs?.hands.isOpen(limb) === true);
  }

  render(): void {
    const { hands, velocity } = this.#stageInputs ?? {};
    this.view.render({
      limbs: this.limbStates(),
      isReady: this.connected && this.#stageInputs !== null && this.#playback !== null && !this.viewOnly,
      performer: this.selectedPerformer.performer,
      giveKey: this.#keyHint("give"),
      selectedLimb: velocity?.selectedLimb ?? null,
      holdsLimb: hands?.isHoldingAny ?? false,
    });
  }

  /** Select the next performer, and announce it: the change is hard to see on the stage. */
  selectNextPerformer(): void {
    const { selectedPerformer: selected } = this;
    if (selected.count < 2) return;
    selected.select((selected.performer + 1) % selected.count);
    this.view.toast(
      this.translator.translate("Dancer {number} of {count}", {
        number: selected.performer + 1,
        count: selected.count,
      }),
    );
  }

  /** Claim a limb if it is free, or pull it with the crowd; else show its holder. Returns whether it is held. */
  claim(limb: number, source: HoldSource): boolean {
    if (!this.canPull(limb) && !this.#stageInputs?.hands.source(limb)) {
      this.onClaimRefused(limb);
      return false;
    }
    return this.#stageInputs?.hands.claim(limb, source) ?? false;
  }

  /** Claim a limb, or release it if this page holds it. */
  toggleClaim(limb: number): void {
    const { hands, velocity } = this.#stageInputs ?? {};
    if (hands?.source(limb)) hands.release(limb);
    else velocity?.hold(limb);
  }

  /** Report a limb that could not be claimed, and offer to ask its holder for it. */
  onClaimRefused(limb: number): void {
    const state = this.limbStates()[limb];
    if (this.viewOnly && this.#playback?.viewer.presence)
      this.view.toast(this.translator.translate("With this link you pull only what is open to the audience"));
    if (this.viewOnly || !state) return;
    this.#stageInputs?.shakeRing(limb);
    const { holder, requestedByMe } = state;
    const name = this.#limbName(limb);
    if (!holder || holder.mine) {
      this.view.toast(this.translator.translate("The {limb} was released", { limb: name }));
    } else if (requestedByMe) {
      this.view.toast(this.translator.translate("You ask {name} for the {limb}", { name: holder.name, limb: name }));
    } else {
      this.#contestedLimb = limb;
      this.view.toast(this.translator.translate("{name} holds the {limb}", { name: holder.name, limb: name }), {
        limb,
        label: this.translator.translate("Ask"),
        key: this.#keyHint("ask"),
      });
    }
  }

  /** Ask the holder for a limb, by default for the last one whose claim failed. */
  requestLimb(limb: number | null = this.#contestedLimb): void {
    if (this.viewOnly) return;
    const holder = limb === null ? null : this.limbStates()[limb]?.holder;
    if (limb === null || !holder || holder.mine) {
      this.view.toast(this.translator.translate("Reach for a string that someone else holds, then ask for it"));
      return;
    }
    this.#contestedLimb = null;
    this.#playback?.puppeteer.ask(limb);
    this.view.toast(
      this.#playback?.puppeteer.isAsking(limb)
        ? this.translator.translate("You ask {name} for the {limb}", { name: holder.name, limb: this.#limbName(limb) })
        : this.translator.translate("Not connected. Ask again when the connection is back"),
    );
    this.render();
  }

  withdrawRequest(limb: number): void {
    this.#playback?.puppeteer.cancelAsk(limb);
    this.render();
  }

  /**
   * Hand a limb over to the first requester, by default the selected limb if it is requested, else any requested one.
   */
  handOver(limb = this.#nextRequestedLimb()): void {
    if (this.viewOnly) return;
    if (limb === null) this.view.toast(this.translator.translate("Nobody is asking for your strings"));
    else this.#stageInputs?.hands.release(limb);
  }

  /**
   * Join two hands that this page holds, or one with a free hand, which is led; part them if they are joined. The hand
   * opposite comes first: dancers face each other.
   */
  joinHands(): void {
    const { puppeteer } = this.#playback ?? {};
    if (this.viewOnly || !puppeteer) return;
    const hands = limbsInKeyOrder(this.selectedPerformer.count).filter(isHand);
    const { hands: inputs } = this.#stageInputs ?? {};
    const held = hands.filter((limb) => inputs?.source(limb) && !inputs.isCrowdPull(limb));
    const bond = puppeteer.bonds.find((pair) => pair.some((limb) => held.includes(limb)));
    if (bond) puppeteer.unbond(bond[0], bond[1]);
    else if (held.length === 0) this.view.toast(this.translator.translate("Hold a hand, then join it with another"));
    else {
      const [first, second] = held;
      const other = second ?? hands.filter((limb) => this.isFree(limb)).sort(byDistanceFrom(first))[0];
      if (other === undefined) this.view.toast(this.translator.translate("These hands cannot be joined"));
      else puppeteer.bond(first, other);
    }
  }

  #describeBondEnd(reason: string): string {
    if (reason === "apart") return this.translator.translate("The dancers are too far apart to join hands");
    if (reason === "released" || reason === "lost") return this.translator.translate("The hands are apart again");
    return this.translator.translate("These hands cannot be joined");
  }

  /** Announce the bonds of this page's hands that have begun. */
  #announceBonds(): void {
    const { bonds = [] } = this.#playback?.puppeteer ?? {};
    const own = bonds.filter((pair) => pair.some((limb) => this.#stageInputs?.hands.source(limb))).map(String);
    if (own.some((pair) => !this.#announcedBonds.includes(pair)))
      this.view.toast(this.translator.translate("The hands are joined"));
    this.#announcedBonds = own;
  }

  #nextRequestedLimb(): number | null {
    const limbs = this.limbStates();
    const requested = limbsInKeyOrder(this.selectedPerformer.count).filter(
      (limb) => limbs[limb].holder?.mine && limbs[limb].requesters.length > 0,
    );
    return requested.find((limb) => limbs[limb].selected) ?? requested[0] ?? null;
  }

  #onLimbGranted(limb: number): void {
    const { hands, velocity } = this.#stageInputs ?? {};
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

/** Return an order of hands to join with `hand`: those of other performers first, and of them the opposite ones. */
function byDistanceFrom(hand: number): (a: number, b: number) => number {
  const rank = (limb: number) =>
    2 * Number(performerOfLimb(limb) === performerOfLimb(hand)) +
    Number(limbWithinPerformer(limb) === limbWithinPerformer(hand));
  return (a, b) => rank(a) - rank(b);
}
