/** Names over the strings, with "Ask" where another holds one, and once the invitation by the nearer hand. */
import { element, setAttribute, setText } from "./dom";
import type { Box } from "../stage/boxes";
import { LIMBS } from "../motion/skeleton";
import { MOST_LIMBS } from "../wire/limbs";
import { pageSpeech } from "../words/say";
import { limbName, type LimbState } from "./model";
import { layLabels, type Laid } from "./tag-layout";

export interface Place {
  x: number;
  y: number;
}

export interface Tags {
  /** Puts each holder's tag by its bar on the screen, CSS pixels, where it covers nothing; null hides it. `faces` are kept free too. */
  render(limbs: readonly LimbState[], bars: readonly (Box | null)[], faces: readonly Box[]): void;
  /** Puts the invitation beside a place; null takes it away. */
  invite(place: Place | null): void;
}

/** Tags begin below this, in the middle of the header. */
const TOP = 32;

/**
 * `ask(limb)` is told of a press on a tag's "Ask"; the same can be done in the card of strings, so the tags are for the eye and the pointer alone. They keep
 * within their layer, which is over the whole picture, and below `top`, CSS pixels. `beside` are boxes at the picture's edge, where the strings of several
 * performers may hang.
 */
export function createTags(root: ParentNode & Node, ask: (limb: number) => void, top = TOP, beside: () => readonly Box[] = () => [], speech = pageSpeech): Tags {
  const { say } = speech;
  const layer = element("div", { class: "tags", "aria-hidden": "true" });
  root.append(layer);
  // told, not asked for: every frame the page would be laid out for it. None while a sheet is before them
  let width = 0;
  new ResizeObserver(([{ contentRect }]) => (width = contentRect.width || width)).observe(layer);
  const tags = Array.from({ length: MOST_LIMBS }, (_, i) => {
    const name = document.createTextNode("");
    const limb = element("span");
    const button = element("button", { class: "tag-ask", type: "button", tabindex: -1, hidden: true, onClick: () => ask(i) }, say("Ask"));
    const tag = element("div", { class: "tag", hidden: true }, name, limb, button);
    layer.append(tag);
    return { name, limb, button, tag, says: "", width: 0, height: 0 };
  });
  let laid: (Laid | null)[] = [];
  const invitation = element("div", { class: "tag invitation", hidden: true }, say("Take a hand"));
  layer.append(invitation);
  return {
    render(limbs, bars, faces) {
      setAttribute(layer, "data-several", limbs.length > LIMBS.length);
      const shown = tags.map((one, i) => (limbs[i]?.holder && bars[i] ? one : null));
      shown.forEach((one, i) => {
        const { tag } = tags[i];
        if (tag.hidden !== !one) tag.hidden = !one;
        const { holder = null, asked = false } = limbs[i] ?? {};
        if (!one || !holder) return;
        // written, and its size asked for, which lays the page out, only where what it says is new
        const says = `${limbs.length}\n${holder.name}\n${holder.colour}\n${asked}\n${holder.mine}`;
        if (one.says === says && one.width > 0) return;
        setText(one.name, holder.name);
        // whose limb it is the string shows that it hangs by
        setText(one.limb, asked ? say("asked") : limbName(i, 1, speech));
        one.button.hidden = holder.mine || asked;
        tag.style.setProperty("--colour", `var(--holder-${holder.colour})`);
        [one.says, one.width, one.height] = [says, tag.offsetWidth, tag.offsetHeight];
      });
      const kept = limbs.length > LIMBS.length && shown.some(Boolean) ? [...faces, ...beside()] : faces;
      laid = layLabels(shown.map((one, i) => one && { bar: bars[i] as Box, width: one.width, height: one.height }), kept, laid, width, top);
      laid.forEach((place, i) => {
        if (place) tags[i].tag.style.transform = `translate(${place.box.left.toFixed(1)}px, ${place.box.top.toFixed(1)}px)`;
      });
    },
    invite(place) {
      invitation.hidden = !place;
      if (!place) return;
      const right = place.x + 150 < width;
      const move = right ? `translate(${(place.x + 26).toFixed(1)}px, ${place.y.toFixed(1)}px) translate(0, -50%)` : `translate(${(place.x - 26).toFixed(1)}px, ${place.y.toFixed(1)}px) translate(-100%, -50%)`;
      invitation.style.transform = move;
    },
  };
}
