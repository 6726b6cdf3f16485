/** Who holds which limb: the card of four rows, and the dock of four discs that stands in while the card is shut. */
import type { DigitalInput } from "../input/inputs";
import { element, setAttribute, setText } from "./dom";
import { limbIcon } from "./icons";
import { LIMB_NAMES, LIMB_ORDER, limbKey, type Holder, type LimbState } from "./model";
import { createMovePad } from "./move-pad";
import { createPanel, type Panel } from "./panels";

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
  const panel = createPanel(root, "strings", "Strings", on.close);
  const lights = (limb: number) => ({
    onFocus: () => on.focus(limb),
    onBlur: () => on.focus(null),
    onPointerenter: () => on.focus(limb),
    onPointerleave: () => on.focus(null),
  });
  const rows = LIMB_ORDER.map((limb) => {
    const state = element("small");
    const glyph = element("button", { class: "limb-glyph", type: "button", disabled: true, "aria-label": `Move the ${LIMB_NAMES[limb].toLowerCase()}`, onClick: () => on.select(limb) }, limbIcon(limb));
    let doing: Doing = "toggle";
    const action = element("button", { class: "limb-action", type: "button", onClick: () => on[doing](limb), ...lights(limb) });
    const pad = createMovePad(limb, on.press);
    const row = element("li", {}, glyph, element("span", {}, element("b", {}, LIMB_NAMES[limb]), state), action, pad.element);
    const render = (limbState: LimbState, ready: boolean) => {
      const { holder, askers, asked, selected } = limbState;
      setAttribute(row, "style", colour(holder));
      setText(state, said(limbState));
      if (!holder) state.append(element("span", { class: "key-hint" }, `, key ${limbKey(limb)}`));
      doing = !holder ? "toggle" : holder.mine ? (askers.length > 0 ? "give" : "toggle") : asked ? "withdraw" : "ask";
      const word = doing === "toggle" ? (holder ? "Release" : "Take") : { give: "Give", ask: "Ask", withdraw: "Withdraw" }[doing];
      setText(action, word);
      action.setAttribute("aria-label", ACTION_NAMES[word](LIMB_NAMES[limb].toLowerCase()));
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
  const hint = element("p", { class: "strings-hint" }, "Drag a ring on the stage, or press ", element("kbd", {}, "1"), " to ", element("kbd", {}, "4"), ".");
  const notice = element("p", { class: "strings-notice", role: "status", "aria-live": "polite" });
  // on a phone the header has no room for it
  const keys = element("button", { class: "text-button", type: "button", onClick: on.keys }, "Touch, gamepad and keys");
  panel.body.append(element("ul", { class: "limbs" }, ...rows.map(({ row }) => row)), hint, notice, keys);
  const dock = element("nav", { class: "dock", "aria-label": "Take a string" }, ...discs.map(({ disc }) => disc));
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
        const limbName = LIMB_NAMES[limb].toLowerCase();
        setAttribute(disc, "style", colour(holder));
        setAttribute(disc, "data-mine", holder?.mine ?? false);
        disc.setAttribute("aria-label", !holder ? `Take the ${limbName}` : holder.mine ? `Release the ${limbName}, held by you` : `${LIMB_NAMES[limb]}, held by ${holder.name}${asked ? ", asked for" : ""}`);
        disc.disabled = !ready;
        name.hidden = !holder;
        setText(name, holder?.name ?? "");
      }
    },
  };
}

const ACTION_NAMES: Readonly<Record<string, (limb: string) => string>> = {
  Take: (limb) => `Take ${limb}`,
  Release: (limb) => `Release ${limb}`,
  Give: (limb) => `Give ${limb}`,
  Ask: (limb) => `Ask for ${limb}`,
  Withdraw: (limb) => `Ask no longer for ${limb}`,
};

function colour(holder: Holder | null): string | null {
  return holder ? `--colour: var(--holder-${holder.colour})` : null;
}

function said({ holder, askers, asked }: LimbState): string {
  if (!holder) return "Free";
  if (holder.mine) return askers.length > 0 ? `${askers[0].name} asks for it` : "You hold this";
  return asked ? `You ask ${holder.name} for it` : `${holder.name} holds this`;
}
