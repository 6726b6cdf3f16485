/** Names over the strings, and once the invitation by the nearer hand. */
import { element, setText } from "./dom";
import { LIMB_NAMES, type Holder } from "./model";

export interface Place {
  x: number;
  y: number;
}

export interface Tags {
  /** Puts each holder's tag where its bar is on the screen, CSS pixels; null hides it. */
  render(holders: readonly (Holder | null)[], places: readonly (Place | null)[]): void;
  /** Puts the invitation beside a place; null takes it away. */
  invite(place: Place | null): void;
}

/** Tags keep out of the header's way. */
const TOP = 60;

export function createTags(root: HTMLElement): Tags {
  const layer = element("div", { class: "tags", "aria-hidden": "true" });
  root.append(layer);
  const tags = [0, 1, 2, 3].map(() => {
    const name = document.createTextNode("");
    const limb = element("span");
    const tag = element("div", { class: "tag", hidden: true }, name, limb);
    layer.append(tag);
    return { name, limb, tag };
  });
  const invitation = element("div", { class: "tag invitation", hidden: true }, "Take a hand");
  layer.append(invitation);
  return {
    render(holders, places) {
      tags.forEach(({ name, limb, tag }, i) => {
        const [holder, place] = [holders[i], places[i]];
        tag.hidden = !holder || !place;
        if (!holder || !place) return;
        setText(name, holder.name);
        setText(limb, LIMB_NAMES[i].toLowerCase());
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
