/** What others ask of one's own limbs, standing until it is given, withdrawn or lapsed. Read out politely; nothing is taken by force. */
import { element } from "./dom";
import { limbName, limbsInOrder, performersOf, type LimbState } from "./model";
import { pageSpeech } from "../words/say";

export interface Asks {
  /** `key` gives the first of them. */
  render(limbs: readonly LimbState[], key: string | null): void;
}

export function createAsks(root: HTMLElement, give: (limb: number) => void, speech = pageSpeech): Asks {
  const { say } = speech;
  const live = element("div", { class: "asks", role: "status", "aria-live": "polite" });
  root.append(live);
  let shown = "";
  return {
    render(limbs, key) {
      const performers = performersOf(limbs);
      const asked = limbsInOrder(performers).filter((limb) => limbs[limb].holder?.mine && limbs[limb].askers.length > 0);
      const now = JSON.stringify([asked.map((limb) => [limb, limbs[limb].askers[0]]), key, performers]);
      if (now === shown) return;
      shown = now;
      const within = live.contains(document.activeElement);
      live.replaceChildren(
        ...asked.map((limb, i) => {
          const { name, colour } = limbs[limb].askers[0];
          const named = { limb: limbName(limb, performers, speech), name };
          const button = element("button", { class: "toast-action", type: "button", "aria-label": say("Give the {limb} to {name}", named), onClick: () => give(limb) }, say("Give"));
          if (key && i === 0) button.append(element("kbd", { class: "key-hint" }, key));
          return element("div", { class: "toast ask", style: `--colour: var(--holder-${colour})` }, say("{name} asks for the {limb}", named), button);
        }),
      );
      if (within) live.querySelector("button")?.focus();
    },
  };
}
