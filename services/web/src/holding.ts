/** Who holds what, who asks for it, and what is done about it: between the session's word, one's own hands, and the page. */
import { Chosen } from "./input/chosen";
import type { Hands, Source } from "./input/hands";
import { controlsOf, isPadControl, type Command, type Mapping } from "./input/mapping";
import type { VelocityInputs } from "./input/velocity";
import { controlName } from "./page/control-names";
import { askers, holders, limbName, limbsInOrder, type LimbState } from "./page/model";
import type { Page } from "./page/page";
import type { Toast } from "./page/toast";
import type { Room } from "./room";
import { limbNumber } from "./wire/limbs";
import { pageSpeech } from "./words/say";

/** What stands on the stage's chunk, and comes after the page. */
export interface Theatre {
  hands: Hands;
  velocity: VelocityInputs;
  /** The ring of a limb shakes. */
  shake(limb: number): void;
}

/** Where it is shown: the page, or as much of one as there is. */
export interface HoldingPage {
  readonly toast: Toast;
  readonly strings: Pick<Page["strings"], "render" | "notice">;
  readonly asks: Page["asks"];
  readonly library?: { readonly danceAs: Pick<Page["library"]["danceAs"], "dancers"> };
}

export class Holding {
  theatre: Theatre | null = null;
  connected = false;
  /** Whether this page only watches: nothing can be taken. */
  watching = false;
  /** Whose strings keys, pad and page act on. */
  readonly chosen = new Chosen(() => this.render());
  #room: Room | null = null;
  /** The limb that was reached for in vain: what "ask" asks for. */
  #wished: number | null = null;

  constructor(private readonly page: HoldingPage, private readonly mapping: () => Mapping, private readonly speech = pageSpeech) {}

  /** The session it is about from now on. */
  enter(room: Room): void {
    this.#room = room;
    this.#wished = null;
    const { viewer, puppeteer } = room;
    if (this.theatre) this.theatre.hands.puppeteer = puppeteer;
    const on = <T>(name: string, told: (detail: T) => void) => puppeteer.addEventListener(name, (event) => told((event as CustomEvent<T>).detail));
    const render = () => this.render();
    const count = () => {
      this.chosen.count = Math.max(1, viewer.performers.length);
      // those of who is on the stage no more
      this.theatre?.hands.letAllGo(limbNumber(this.chosen.count, 0));
    };
    count();
    viewer.addEventListener("figure", count);
    viewer.addEventListener("tracks", count);
    viewer.addEventListener("presence", render);
    on("welcome", render);
    on("presence", render);
    on<{ limb: number }>("refusal", ({ limb }) => {
      this.theatre?.hands.refused(limb);
      this.refused(limb);
    });
    on<{ limb: number; asked: boolean }>("grant", ({ limb, asked }) => {
      if (asked) this.#given(limb);
    });
    on<{ limb: number; free: boolean }>("lapsed", ({ limb, free }) => {
      this.page.toast(this.speech.say(free ? "The {limb} is free now" : "The {limb} was not given", { limb: this.#name(limb) }));
      this.render();
    });
    on<{ detail: string }>("notice", ({ detail }) => this.page.strings.notice(this.speech.heard(detail)));
  }

  /** The limbs of all performers as the session says, and one's own at once, before it has answered. */
  limbs(): LimbState[] {
    const { puppeteer, viewer } = this.#room ?? {};
    const { hands, velocity } = this.theatre ?? {};
    const who = [viewer?.presence ?? null, puppeteer?.id ?? null, this.chosen.count, this.speech] as const;
    const told = holders(...who);
    const asking = askers(...who);
    return told.map((one, limb) => {
      const mine = Boolean(hands?.source(limb));
      const holder = mine ? { id: puppeteer?.id ?? "", name: this.speech.say("You"), colour: puppeteer?.colour ?? 0, mine } : one?.mine ? null : one;
      return { holder, askers: asking[limb], asked: puppeteer?.asks(limb) ?? false, selected: velocity?.selected === limb && velocity.holds(limb) };
    });
  }

  free(limb: number): boolean {
    const state = this.limbs()[limb];
    return !this.watching && state !== undefined && !state.holder;
  }

  render(): void {
    const limbs = this.limbs();
    this.page.strings.render(limbs, this.connected && this.#room !== null && !this.watching, this.chosen.performer);
    this.page.asks.render(limbs, this.#key("give"));
    this.page.library?.danceAs.dancers(limbs, this.chosen.performer);
  }

  /** Turns to the next performer, by a key or button: it is said, as what is seen of it is little. */
  nextDancer(): void {
    const { chosen } = this;
    if (chosen.count < 2) return;
    chosen.choose((chosen.performer + 1) % chosen.count);
    this.page.toast(this.speech.say("Dancer {number} of {count}", { number: chosen.performer + 1, count: chosen.count }));
  }

  /** Takes a limb if it is free; if not, says who has it. */
  take(limb: number, source: Source): boolean {
    if (!this.free(limb) && !this.theatre?.hands.source(limb)) {
      this.refused(limb);
      return false;
    }
    return this.theatre?.hands.take(limb, source) ?? false;
  }

  /** The page's button of a limb: takes it, or lets it go. */
  toggle(limb: number): void {
    if (this.watching) return;
    const { hands, velocity } = this.theatre ?? {};
    if (hands?.source(limb)) hands.letGo(limb);
    else velocity?.hold(limb);
  }

  /** A limb that was reached for is another's. */
  refused(limb: number): void {
    const state = this.limbs()[limb];
    if (this.watching || !state) return;
    this.theatre?.shake(limb);
    const { holder, asked } = state;
    const name = this.#name(limb);
    if (!holder || holder.mine) {
      this.page.toast(this.speech.say("The {limb} was let go", { limb: name }));
    } else if (asked) {
      this.page.toast(this.speech.say("You ask {name} for the {limb}", { name: holder.name, limb: name }));
    } else {
      this.#wished = limb;
      this.page.toast(this.speech.say("{name} holds the {limb}", { name: holder.name, limb: name }), { label: this.speech.say("Ask"), key: this.#key("ask"), act: () => this.ask(limb) });
    }
  }

  /** Asks the holder for a limb; without one, for that which was reached for last. */
  ask(limb = this.#wished): void {
    if (this.watching) return;
    const holder = limb === null ? null : this.limbs()[limb]?.holder;
    if (limb === null || !holder || holder.mine) {
      this.page.toast(this.speech.say("Reach for a string that another holds, then ask for it"));
      return;
    }
    this.#wished = null;
    this.#room?.puppeteer.ask(limb);
    this.page.toast(this.#room?.puppeteer.asks(limb) ? this.speech.say("You ask {name} for the {limb}", { name: holder.name, limb: this.#name(limb) }) : this.speech.say("The line is lost; ask again when it is back"));
    this.render();
  }

  withdraw(limb: number): void {
    this.#room?.puppeteer.withdraw(limb);
    this.render();
  }

  /** Gives a limb to the first who asks for it; without one, the selected limb if it is asked for, else any that is. */
  give(limb = this.#askedOfMe()): void {
    if (this.watching) return;
    if (limb === null) this.page.toast(this.speech.say("Nobody asks for a string of yours"));
    else this.theatre?.hands.letGo(limb);
  }

  #askedOfMe(): number | null {
    const limbs = this.limbs();
    const asked = limbsInOrder(this.chosen.count).filter((limb) => limbs[limb].holder?.mine && limbs[limb].askers.length > 0);
    return asked.find((limb) => limbs[limb].selected) ?? asked[0] ?? null;
  }

  #given(limb: number): void {
    const { hands, velocity } = this.theatre ?? {};
    if (!hands?.take(limb, "velocity")) {
      this.#room?.puppeteer.release(limb);
      return;
    }
    velocity?.hold(limb);
    this.page.toast(this.speech.say("The {limb} is yours", { limb: this.#name(limb) }));
    this.render();
  }

  #name(limb: number): string {
    return limbName(limb, this.chosen.count, this.speech);
  }

  #key(command: Command): string | null {
    const control = controlsOf(this.mapping(), command).find((one) => !isPadControl(one));
    return control === undefined ? null : controlName(control, this.speech);
  }
}
