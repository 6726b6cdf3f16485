/** Names over the strings, with "Ask" where another holds one, and once the invitation by the nearer hand. */
import { element, setText } from "./dom";
import { LIMB_NAMES, type LimbState } from "./model";
import { say } from "../words/say";

export interface Place {
  x: number;
  y: number;
}

export interface Tags {
  /** Puts each holder's tag where its bar is on the screen, CSS pixels; null hides it. */
  render(limbs: readonly LimbState[], places: readonly (Place | null)[]): void;
  /** Puts the invitation beside a place; null takes it away. */
  invite(place: Place | null): void;
}

/** Tags keep out of the header's way. */
const TOP = 60;

/** `ask(limb)` is told of a press on a tag's "Ask"; the same can be done in the card of strings, so the tags are for the eye and the pointer alone. */
export function createTags(root: HTMLElement, ask: (limb: number) => void): Tags {
  const layer = element("div", { class: "tags", "aria-hidden": "true" });
  root.append(layer);
  const tags = [0, 1, 2, 3].map((i) => {
    const name = document.createTextNode("");
    const limb = element("span");
    const button = element("button", { class: "tag-ask", type: "button", tabindex: -1, hidden: true, onClick: () => ask(i) }, say("Ask"));
    const tag = element("div", { class: "tag", hidden: true }, name, limb, button);
    layer.append(tag);
    return { name, limb, button, tag };
  });
  const invitation = element("div", { class: "tag invitation", hidden: true }, say("Take a hand"));
  layer.append(invitation);
  return {
    render(limbs, places) {
      tags.forEach(({ name, limb, button, tag }, i) => {
        const [{ holder, asked }, place] = [limbs[i], places[i]];
        tag.hidden = !holder || !place;
        if (!holder || !place) return;
        setText(name, holder.name);
        setText(limb, asked ? say("asked") : say(LIMB_NAMES[i]).toLowerCase());
        button.hidden = holder.mine || asked;
        tag.style.setProperty("--colour", `var(--holder-${holder.colour})`);
        const x = Math.min(innerWidth - 80, Math.max(80, place.x));
        tag.style.transform = `translate(${x.toFixed(1)}px, ${Math.max(TOP, place.y - 12).toFixed(1)}px) translate(-50%, -100%)`;
      });
    },
    invite(place) {
      invitation.hidden = !place;
      if (!place) return;
      const right = place.x + 150 < innerWidth;
      const move = right ? `translate(${(place.x + 26).toFixed(1)}px, ${place.y.toFixed(1)}px) translate(0, -50%)` : `translate(${(place.x - 26).toFixed(1)}px, ${place.y.toFixed(1)}px) translate(-100%, -50%)`;
      invitation.style.transform = move;
    },
  };
}
