/** Who holds which limb: the card of four rows, and the dock of four discs that stands in while the card is shut. */
import type { DigitalInput } from "../input/inputs";
import { element, setAttribute, setText } from "./dom";
import { limbIcon } from "./icons";
import { LIMB_NAMES, LIMB_ORDER, limbKey, type Holder, type LimbState } from "./model";
import { createMovePad } from "./move-pad";
import { createPanel, type Panel } from "./panels";
import { say, sayAround } from "../words/say";

/** A notice stands so long, milliseconds. */
const NOTICE = 5_000;

export interface StringsCard {
  readonly panel: Panel;
  /** Shows the limbs; without `ready` nothing can be taken. */
  render(limbs: readonly LimbState[], ready: boolean): void;
  dock(shown: boolean): void;
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
  /** A button of the page goes down or comes up. */
  press(input: DigitalInput, down: boolean): void;
}

type Doing = "toggle" | "ask" | "withdraw" | "give";

export function createStringsCard(root: HTMLElement, on: StringsActions & { close(): void; keys(): void }): StringsCard {
  const panel = createPanel(root, "strings", say("Strings"), on.close);
  const lights = (limb: number) => ({
    onFocus: () => on.focus(limb),
    onBlur: () => on.focus(null),
    onPointerenter: () => on.focus(limb),
    onPointerleave: () => on.focus(null),
  });
  const rows = LIMB_ORDER.map((limb) => {
    const state = element("small");
    const glyph = element("button", { class: "limb-glyph", type: "button", disabled: true, "aria-label": say("Move the {limb}", { limb: say(LIMB_NAMES[limb]).toLowerCase() }), onClick: () => on.select(limb) }, limbIcon(limb));
    let doing: Doing = "toggle";
    const action = element("button", { class: "limb-action", type: "button", onClick: () => on[doing](limb), ...lights(limb) });
    const pad = createMovePad(limb, on.press);
    const row = element("li", {}, glyph, element("span", {}, element("b", {}, say(LIMB_NAMES[limb])), state), action, pad.element);
    const render = (limbState: LimbState, ready: boolean) => {
      const { holder, askers, asked, selected } = limbState;
      setAttribute(row, "style", colour(holder));
      setText(state, said(limbState));
      if (!holder) state.append(element("span", { class: "key-hint" }, say(", key {key}", { key: limbKey(limb) })));
      doing = !holder ? "toggle" : holder.mine ? (askers.length > 0 ? "give" : "toggle") : asked ? "withdraw" : "ask";
      const word = doing === "toggle" ? (holder ? "Release" : "Take") : ({ give: "Give", ask: "Ask", withdraw: "Withdraw" } as const)[doing];
      setText(action, say(word));
      action.setAttribute("aria-label", say(ACTION_NAMES[word], { limb: say(LIMB_NAMES[limb]).toLowerCase() }));
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
    const disc = element("button", { type: "button", onClick: () => on.toggle(limb), ...lights(limb) }, limbIcon(limb), name);
    return { limb, disc, name };
  });
  const hint = element("p", { class: "strings-hint" }, ...sayAround("Drag a ring on the stage, or press {first} to {last}.", { first: element("kbd", {}, "1"), last: element("kbd", {}, "4") }));
  const notice = element("p", { class: "strings-notice", role: "status", "aria-live": "polite" });
  // on a phone the header has no room for it
  const keys = element("button", { class: "text-button", type: "button", onClick: on.keys }, say("Touch, gamepad and keys"));
  panel.body.append(element("ul", { class: "limbs" }, ...rows.map(({ row }) => row)), hint, notice, keys);
  const dock = element("nav", { class: "dock", "aria-label": say("Take a string") }, ...discs.map(({ disc }) => disc));
  root.append(dock);
  let fading: ReturnType<typeof setTimeout> | undefined;
  return {
    panel,
    dock(shown) {
      dock.hidden = !shown;
    },
    notice(text) {
      clearTimeout(fading);
      setText(notice, text);
      hint.hidden = true;
      fading = setTimeout(() => {
        setText(notice, "");
        hint.hidden = false;
      }, NOTICE);
    },
    render(limbs, ready) {
      for (const { limb, render } of rows) render(limbs[limb], ready);
      for (const { limb, disc, name } of discs) {
        const { holder, asked } = limbs[limb];
        const limbName = say(LIMB_NAMES[limb]).toLowerCase();
        setAttribute(disc, "style", colour(holder));
        setAttribute(disc, "data-mine", holder?.mine ?? false);
        disc.setAttribute("aria-label", !holder ? say("Take the {limb}", { limb: limbName }) : holder.mine ? say("Release the {limb}, held by you", { limb: limbName }) : say(asked ? "{limb}, held by {name}, asked for" : "{limb}, held by {name}", { limb: say(LIMB_NAMES[limb]), name: holder.name }));
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
