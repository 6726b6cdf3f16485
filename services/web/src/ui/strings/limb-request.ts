/** What others ask of one's own limbs, standing until it is given, withdrawn or lapsed. Read out politely; nothing is taken by force. */

import { pageTranslator } from "../../i18n/translator";
import { element } from "../dom";
import { type LimbState, limbName, limbsInKeyOrder, performerCount } from "../limb-state";

export interface LimbRequests {
  /** `key` gives the first of them. */
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
    render(limbs, key) {
      const performers = performerCount(limbs);
      const asked = limbsInKeyOrder(performers).filter(
        (limb) => limbs[limb].holder?.mine && limbs[limb].requesters.length > 0,
      );
      const now = JSON.stringify([asked.map((limb) => [limb, limbs[limb].requesters[0]]), key, performers]);
      if (now === shown) return;
      shown = now;
      const within = live.contains(document.activeElement);
      live.replaceChildren(
        ...asked.map((limb, i) => {
          const { name, colour } = limbs[limb].requesters[0];
          const named = { limb: limbName(limb, performers, translator), name };
          const button = element(
            "button",
            {
              class: "toast-action",
              type: "button",
              "aria-label": translate("Give the {limb} to {name}", named),
              onClick: () => onGive(limb),
            },
            translate("Give"),
          );
          if (key && i === 0) button.append(element("kbd", { class: "key-hint" }, key));
          return element(
            "div",
            { class: "toast ask", style: `--colour: var(--holder-${colour})` },
            translate("{name} asks for the {limb}", named),
            button,
          );
        }),
      );
      if (within) live.querySelector("button")?.focus();
    },
  };
}
