/** Requests of other users for limbs that this page holds, shown until they are granted, withdrawn or expired. */
import { pageTranslator } from "../../i18n/translator";
import { element } from "../dom";
import { type LimbState, limbName, limbsInKeyOrder, performerCount } from "../limb-state";

export interface LimbRequests {
  /** Show the requests. `keyHint` names the key that grants the first one. */
  render(limbs: readonly LimbState[], keyHint: string | null): void;
}

export function createLimbRequests(
  root: HTMLElement,
  onGive: (limb: number) => void,
  translator = pageTranslator,
): LimbRequests {
  const { translate } = translator;
  const live = element("div", { class: "asks", role: "status", "aria-live": "polite" });
  root.append(live);
  let shown = "";
  return {
    render(limbs, keyHint) {
      const performers = performerCount(limbs);
      const requested = limbsInKeyOrder(performers).filter(
        (limb) => limbs[limb].holder?.mine && limbs[limb].requesters.length > 0,
      );
      const content = JSON.stringify([requested.map((limb) => [limb, limbs[limb].requesters[0]]), keyHint, performers]);
      if (content === shown) return;
      shown = content;
      const hadFocus = live.contains(document.activeElement);
      live.replaceChildren(
        ...requested.map((limb, i) => {
          const { name, colour } = limbs[limb].requesters[0];
          const names = { limb: limbName(limb, performers, translator), name };
          const button = element(
            "button",
            {
              class: "toast-action",
              type: "button",
              "aria-label": translate("Give the {limb} to {name}", names),
              onClick: () => onGive(limb),
            },
            translate("Give"),
          );
          if (keyHint && i === 0) button.append(element("kbd", { class: "key-hint" }, keyHint));
          return element(
            "div",
            { class: "toast ask", style: `--colour: var(--holder-${colour})` },
            translate("{name} asks for the {limb}", names),
            button,
          );
        }),
      );
      if (hadFocus) live.querySelector("button")?.focus();
    },
  };
}
