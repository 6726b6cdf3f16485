/** Who holds which limb: the card of four rows, and the dock of four discs that stands in while the card is shut. */

import { translate, translateToParts } from "../../i18n/translator";
import type { DigitalInput } from "../../input/digital-input";
import { limbNumber } from "../../wire/limbs";
import { element, setAttribute, setText } from "../dom";
import { limbIcon } from "../icon";
import {
  LIMB_NAMES,
  LIMB_ORDER,
  type LimbHolder,
  type LimbState,
  limbKey,
  limbName,
  performerCount,
} from "../limb-state";
import { createPanel, type Panel } from "../panel";
import { createDirectionPad } from "./direction-pad";
import { createNextPerformerButton, createPerformerChooser } from "./performer-chooser";

/** A notice stands so long, milliseconds. */
const NOTICE_DURATION_MS = 5_000;

export interface StringsPanel {
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

type LimbAction = "toggle" | "ask" | "withdraw" | "give";

export function createStringsPanel(
  root: HTMLElement,
  actions: StringsActions & { close(): void; keys(): void },
): StringsPanel {
  const panel = createPanel(root, "strings", translate("Strings"), actions.close);
  /** Whose limbs the rows show, of how many. */
  let [performer, performers] = [0, 1];
  const own = (part: number) => limbNumber(performer, part);
  const lights = (part: number) => ({
    onFocus: () => actions.focus(own(part)),
    onBlur: () => actions.focus(null),
    onPointerenter: () => actions.focus(own(part)),
    onPointerleave: () => actions.focus(null),
  });
  const rows = LIMB_ORDER.map((limb) => {
    const state = element("small");
    const glyph = element(
      "button",
      { class: "limb-glyph", type: "button", disabled: true, onClick: () => actions.select(own(limb)) },
      limbIcon(limb),
    );
    let doing: LimbAction = "toggle";
    const action = element("button", {
      class: "limb-action",
      type: "button",
      onClick: () => actions[doing](own(limb)),
      ...lights(limb),
    });
    const pad = createDirectionPad(limb, actions.press);
    const row = element(
      "li",
      {},
      glyph,
      element("span", {}, element("b", {}, translate(LIMB_NAMES[limb])), state),
      action,
      pad.element,
    );
    const render = (limbState: LimbState, ready: boolean) => {
      const { holder, requesters: askers, requestedByMe: asked, selected } = limbState;
      setAttribute(row, "style", holderStyle(holder));
      const name = { limb: limbName(own(limb), performers) };
      setText(state, limbStatus(limbState));
      if (!holder)
        state.append(element("span", { class: "key-hint" }, translate(", key {key}", { key: limbKey(limb) })));
      doing = !holder ? "toggle" : holder.mine ? (askers.length > 0 ? "give" : "toggle") : asked ? "withdraw" : "ask";
      const word =
        doing === "toggle"
          ? holder
            ? "Release"
            : "Take"
          : ({ give: "Give", ask: "Ask", withdraw: "Withdraw" } as const)[doing];
      setText(action, translate(word));
      action.setAttribute("aria-label", translate(ACTION_LABELS[word], name));
      glyph.setAttribute("aria-label", translate("Move the {limb}", name));
      action.disabled = !ready;
      setAttribute(action, "data-mine", holder?.mine ?? false);
      const mine = holder?.mine ?? false;
      glyph.disabled = !mine || !ready;
      setAttribute(glyph, "aria-pressed", mine ? String(selected) : null);
      // also while the line is away: what is held is asked for again, and who presses goes on
      pad.setVisible(mine && selected);
    };
    return { limb, row, render };
  });
  const discs = LIMB_ORDER.map((limb) => {
    const name = element("span", { hidden: true });
    const disc = element(
      "button",
      { type: "button", onClick: () => actions.toggle(own(limb)), ...lights(limb) },
      limbIcon(limb),
      name,
    );
    return { limb, disc, name };
  });
  const hint = element(
    "p",
    { class: "strings-hint" },
    ...translateToParts("Drag a ring on the stage, or press {first} to {last}.", {
      first: element("kbd", {}, "1"),
      last: element("kbd", {}, "4"),
    }),
  );
  const notice = element("p", { class: "strings-notice", role: "status", "aria-live": "polite" });
  // on a phone the header has no room for it
  const keys = element(
    "button",
    { class: "text-button", type: "button", onClick: actions.keys },
    translate("Touch, gamepad and keys"),
  );
  const chooser = createPerformerChooser(actions.dancer);
  const next = createNextPerformerButton(actions.nextDancer);
  panel.body.append(
    chooser.element,
    element("ul", { class: "limbs" }, ...rows.map(({ row }) => row)),
    hint,
    notice,
    keys,
  );
  const dock = element(
    "nav",
    { class: "dock", "aria-label": translate("Take a string") },
    next.element,
    ...discs.map(({ disc }) => disc),
  );
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
      }, NOTICE_DURATION_MS);
    },
    render(limbs, ready, chosen = 0) {
      [performer, performers] = [chosen, performerCount(limbs)];
      for (const part of [chooser, next]) part.render(limbs, chosen);
      for (const { limb, render } of rows) render(limbs[own(limb)], ready);
      for (const { limb, disc, name } of discs) {
        const { holder, requestedByMe: asked } = limbs[own(limb)];
        const named = limbName(own(limb), performers);
        const capital = named.charAt(0).toUpperCase() + named.slice(1);
        setAttribute(disc, "style", holderStyle(holder));
        setAttribute(disc, "data-mine", holder?.mine ?? false);
        disc.setAttribute(
          "aria-label",
          !holder
            ? translate("Take the {limb}", { limb: named })
            : holder.mine
              ? translate("Release the {limb}, held by you", { limb: named })
              : translate(asked ? "{limb}, held by {name}, asked for" : "{limb}, held by {name}", {
                  limb: capital,
                  name: holder.name,
                }),
        );
        disc.disabled = !ready;
        name.hidden = !holder;
        setText(name, holder?.name ?? "");
      }
    },
  };
}

const ACTION_LABELS = {
  Take: "Take {limb}",
  Release: "Release {limb}",
  Give: "Give {limb}",
  Ask: "Ask for {limb}",
  Withdraw: "Ask no longer for {limb}",
} as const;

function holderStyle(holder: LimbHolder | null): string | null {
  return holder ? `--colour: var(--holder-${holder.colour})` : null;
}

function limbStatus({ holder, requesters: askers, requestedByMe: asked }: LimbState): string {
  if (!holder) return translate("Free");
  if (holder.mine)
    return askers.length > 0 ? translate("{name} asks for it", { name: askers[0].name }) : translate("You hold this");
  return translate(asked ? "You ask {name} for it" : "{name} holds this", { name: holder.name });
}
