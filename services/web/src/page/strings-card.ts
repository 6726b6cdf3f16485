/** Who holds which limb: the card of four rows, and the dock of four discs that stands in while the card is shut. */
import type { DigitalInput } from "../input/inputs";
import { element, setAttribute, setText } from "./dom";
import { limbIcon } from "./icons";
import { createDancerChooser, createNextDancer } from "./dancer-chooser";
import { LIMB_NAMES, LIMB_ORDER, limbKey, limbName, performersOf, type Holder, type LimbState } from "./model";
import { createMovePad } from "./move-pad";
import { createPanel, type Panel } from "./panels";
import { limbNumber } from "../wire/limbs";
import { say, sayAround } from "../words/say";

/** A notice stands so long, milliseconds. */
const NOTICE = 5_000;

export interface StringsCard {
  readonly panel: Panel;
  /** Shows the limbs of the `chosen` performer of all whose limbs these are; without `ready` nothing can be taken. */
  render(limbs: readonly LimbState[], ready: boolean, chosen?: number): void;
  readonly dock: HTMLElement;
  /** A quiet line about an input that was not taken as it came. */
  notice(text: string): void;
}

export interface StringsActions {
  toggle(limb: number): void;
  ask(limb: number): void;
  withdraw(limb: number): void;
  give(limb: number): void;
  select(limb: number): void;
  focus(limb: number | null): void;
  /** Chooses a performer, or the next one. */
  dancer(performer: number): void;
  nextDancer(): void;
  /** A button of the page goes down or comes up. */
  press(input: DigitalInput, down: boolean): void;
}

type Doing = "toggle" | "ask" | "withdraw" | "give";

export function createStringsCard(root: HTMLElement, on: StringsActions & { close(): void; keys(): void }): StringsCard {
  const panel = createPanel(root, "strings", say("Strings"), on.close);
  /** Whose limbs the rows show, of how many. */
  let [performer, performers] = [0, 1];
  const own = (part: number) => limbNumber(performer, part);
  const lights = (part: number) => ({
    onFocus: () => on.focus(own(part)),
    onBlur: () => on.focus(null),
    onPointerenter: () => on.focus(own(part)),
    onPointerleave: () => on.focus(null),
  });
  const rows = LIMB_ORDER.map((limb) => {
    const state = element("small");
    const glyph = element("button", { class: "limb-glyph", type: "button", disabled: true, onClick: () => on.select(own(limb)) }, limbIcon(limb));
    let doing: Doing = "toggle";
    const action = element("button", { class: "limb-action", type: "button", onClick: () => on[doing](own(limb)), ...lights(limb) });
    const pad = createMovePad(limb, on.press);
    const row = element("li", {}, glyph, element("span", {}, element("b", {}, say(LIMB_NAMES[limb])), state), action, pad.element);
    const render = (limbState: LimbState, ready: boolean) => {
      const { holder, askers, asked, selected } = limbState;
      setAttribute(row, "style", colour(holder));
      const name = { limb: limbName(own(limb), performers) };
      setText(state, said(limbState));
      if (!holder) state.append(element("span", { class: "key-hint" }, say(", key {key}", { key: limbKey(limb) })));
      doing = !holder ? "toggle" : holder.mine ? (askers.length > 0 ? "give" : "toggle") : asked ? "withdraw" : "ask";
      const word = doing === "toggle" ? (holder ? "Release" : "Take") : ({ give: "Give", ask: "Ask", withdraw: "Withdraw" } as const)[doing];
      setText(action, say(word));
      action.setAttribute("aria-label", say(ACTION_NAMES[word], name));
      glyph.setAttribute("aria-label", say("Move the {limb}", name));
      action.disabled = !ready;
      setAttribute(action, "data-mine", holder?.mine ?? false);
      const mine = holder?.mine ?? false;
      glyph.disabled = !mine || !ready;
      setAttribute(glyph, "aria-pressed", mine ? String(selected) : null);
      // also while the line is away: what is held is asked for again, and who presses goes on
      pad.show(mine && selected);
    };
    return { limb, row, render };
  });
  const discs = LIMB_ORDER.map((limb) => {
    const name = element("span", { hidden: true });
    const disc = element("button", { type: "button", onClick: () => on.toggle(own(limb)), ...lights(limb) }, limbIcon(limb), name);
    return { limb, disc, name };
  });
  const hint = element("p", { class: "strings-hint" }, ...sayAround("Drag a ring on the stage, or press {first} to {last}.", { first: element("kbd", {}, "1"), last: element("kbd", {}, "4") }));
  const notice = element("p", { class: "strings-notice", role: "status", "aria-live": "polite" });
  // on a phone the header has no room for it
  const keys = element("button", { class: "text-button", type: "button", onClick: on.keys }, say("Touch, gamepad and keys"));
  const chooser = createDancerChooser(on.dancer);
  const next = createNextDancer(on.nextDancer);
  panel.body.append(chooser.element, element("ul", { class: "limbs" }, ...rows.map(({ row }) => row)), hint, notice, keys);
  const dock = element("nav", { class: "dock", "aria-label": say("Take a string") }, next.element, ...discs.map(({ disc }) => disc));
  root.append(dock);
  let fading: ReturnType<typeof setTimeout> | undefined;
  return {
    panel,
    dock,
    notice(text) {
      clearTimeout(fading);
      setText(notice, text);
      hint.hidden = true;
      fading = setTimeout(() => {
        setText(notice, "");
        hint.hidden = false;
      }, NOTICE);
    },
    render(limbs, ready, chosen = 0) {
      [performer, performers] = [chosen, performersOf(limbs)];
      for (const part of [chooser, next]) part.render(limbs, chosen);
      for (const { limb, render } of rows) render(limbs[own(limb)], ready);
      for (const { limb, disc, name } of discs) {
        const { holder, asked } = limbs[own(limb)];
        const named = limbName(own(limb), performers);
        const capital = named.charAt(0).toUpperCase() + named.slice(1);
        setAttribute(disc, "style", colour(holder));
        setAttribute(disc, "data-mine", holder?.mine ?? false);
        disc.setAttribute("aria-label", !holder ? say("Take the {limb}", { limb: named }) : holder.mine ? say("Release the {limb}, held by you", { limb: named }) : say(asked ? "{limb}, held by {name}, asked for" : "{limb}, held by {name}", { limb: capital, name: holder.name }));
        disc.disabled = !ready;
        name.hidden = !holder;
        setText(name, holder?.name ?? "");
      }
    },
  };
}

const ACTION_NAMES = {
  Take: "Take {limb}",
  Release: "Release {limb}",
  Give: "Give {limb}",
  Ask: "Ask for {limb}",
  Withdraw: "Ask no longer for {limb}",
} as const;

function colour(holder: Holder | null): string | null {
  return holder ? `--colour: var(--holder-${holder.colour})` : null;
}

function said({ holder, askers, asked }: LimbState): string {
  if (!holder) return say("Free");
  if (holder.mine) return askers.length > 0 ? say("{name} asks for it", { name: askers[0].name }) : say("You hold this");
  return say(asked ? "You ask {name} for it" : "{name} holds this", { name: holder.name });
}
