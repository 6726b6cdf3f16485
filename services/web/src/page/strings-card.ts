/** Who holds which limb: the card of four rows, and the dock of four discs that stands in while the card is shut. */
import { element, setAttribute, setText } from "./dom";
import { limbIcon } from "./icons";
import { LIMB_NAMES, LIMB_ORDER, limbKey, type Holder } from "./model";
import { createPanel, type Panel } from "./panels";

export interface StringsCard {
  readonly panel: Panel;
  /** Shows holders by limb; without `ready` nothing can be taken. */
  render(holders: readonly (Holder | null)[], ready: boolean): void;
  dock(shown: boolean): void;
}

export function createStringsCard(root: HTMLElement, on: { toggle(limb: number): void; focus(limb: number | null): void; close(): void }): StringsCard {
  const panel = createPanel(root, "strings", "Strings", on.close);
  const lights = (limb: number) => ({
    onFocus: () => on.focus(limb),
    onBlur: () => on.focus(null),
    onPointerenter: () => on.focus(limb),
    onPointerleave: () => on.focus(null),
  });
  const rows = LIMB_ORDER.map((limb) => {
    const state = element("small");
    const action = element("button", { class: "limb-action", type: "button", onClick: () => on.toggle(limb), ...lights(limb) });
    const row = element("li", {}, element("span", { class: "limb-glyph" }, limbIcon(limb)), element("span", {}, element("b", {}, LIMB_NAMES[limb]), state), action);
    return { limb, row, state, action };
  });
  const discs = LIMB_ORDER.map((limb) => {
    const name = element("span", { hidden: true });
    const disc = element("button", { type: "button", onClick: () => on.toggle(limb), ...lights(limb) }, limbIcon(limb), name);
    return { limb, disc, name };
  });
  const hint = element("p", { class: "strings-hint" }, "Drag a ring on the stage, or press ", element("kbd", {}, "1"), " to ", element("kbd", {}, "4"), ".");
  panel.body.append(element("ul", { class: "limbs" }, ...rows.map(({ row }) => row)), hint);
  const dock = element("nav", { class: "dock", "aria-label": "Take a string" }, ...discs.map(({ disc }) => disc));
  root.append(dock);
  return {
    panel,
    dock(shown) {
      dock.hidden = !shown;
    },
    render(holders, ready) {
      const colour = (holder: Holder | null) => (holder ? `--colour: var(--holder-${holder.colour})` : null);
      for (const { limb, row, state, action } of rows) {
        const holder = holders[limb];
        setAttribute(row, "style", colour(holder));
        setText(state, holder ? (holder.mine ? "You hold this" : `${holder.name} holds this`) : "Free");
        if (!holder) state.append(element("span", { class: "key-hint" }, `, key ${limbKey(limb)}`));
        const word = !holder ? "Take" : holder.mine ? "Release" : "Held";
        setText(action, word);
        action.setAttribute("aria-label", `${word} ${LIMB_NAMES[limb].toLowerCase()}`);
        action.disabled = !ready || (holder !== null && !holder.mine);
        setAttribute(action, "data-mine", holder?.mine ?? false);
      }
      for (const { limb, disc, name } of discs) {
        const holder = holders[limb];
        const limbName = LIMB_NAMES[limb].toLowerCase();
        setAttribute(disc, "style", colour(holder));
        setAttribute(disc, "data-mine", holder?.mine ?? false);
        disc.setAttribute("aria-label", !holder ? `Take the ${limbName}` : holder.mine ? `Release the ${limbName}` : `${LIMB_NAMES[limb]}, held by ${holder.name}`);
        disc.disabled = !ready;
        name.hidden = !holder;
        setText(name, holder?.name ?? "");
      }
    },
  };
}
