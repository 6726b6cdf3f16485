/** Names over the strings, with "Ask" where another holds one, and once the invitation by the nearer hand. */

import { pageTranslator } from "../../i18n/translator";
import { LIMBS } from "../../motion/skeleton";
import type { ScreenBox } from "../../stage/camera/screen-box";
import { MAX_LIMBS, performerOfLimb } from "../../wire/limbs";
import { element, setAttribute, setText } from "../dom";
import { initialOf } from "../format";
import { type LimbState, limbName } from "../limb-state";
import { type LabelPlacement, layOutLabels, placeBeside, type Size } from "./tag-layout";

export interface ScreenPoint {
  x: number;
  y: number;
}

export interface NameTags {
  /**
   * Puts each holder's tag by its bar on the screen at `now`, milliseconds, where it covers nothing; bars are CSS pixels, null hides the tag. `faces` are kept free
   * too. One's own and those of the `chosen` performer have the first choice.
   */
  render(
    limbs: readonly LimbState[],
    bars: readonly (ScreenBox | null)[],
    faces: readonly ScreenBox[],
    now: number,
    chosen?: number,
  ): void;
  /** Puts the invitation beside a place, clear of what the last tags were; null takes it away. */
  invite(place: ScreenPoint | null): void;
}

/** Tags begin below this, in the middle of the header. */
const TOP_MARGIN_PX = 32;
/** How a tag is written, from the whole to the shortest: name, limb and "Ask"; the name alone; its initial. */
const TAG_FORMS = ["whole", "name", "initial"] as const;
/** From a hand to the invitation, pixels. */
const INVITATION_DISTANCE_PX = 26;

/**
 * `ask(limb)` is told of a press on a tag's "Ask"; the same can be done in the card of strings, so the tags are for the eye and the pointer alone. They keep
 * within their layer, which is over the whole picture, and below `top`, CSS pixels. `beside` are boxes of what else stands before the picture.
 */
export function createNameTags(
  root: ParentNode & Node,
  onRequest: (limb: number) => void,
  top = TOP_MARGIN_PX,
  getObstacles: () => readonly ScreenBox[] = () => [],
  translator = pageTranslator,
): NameTags {
  const { translate } = translator;
  const layer = element("div", { class: "tags", "aria-hidden": "true" });
  root.append(layer);
  // told, not asked for: every frame the page would be laid out for it. None while a sheet is before them
  let [width, height] = [0, 0];
  let laid: (LabelPlacement | null)[] = [];
  new ResizeObserver(([{ contentRect }]) => {
    if (contentRect.width === 0) return;
    // in another picture all stand anew, and may be written otherwise
    [width, height, laid] = [contentRect.width, contentRect.height, []];
    for (const one of tags) one.says = "";
  }).observe(layer);
  const tags = Array.from({ length: MAX_LIMBS }, (_, i) => {
    const [name, letter, limb] = [element("b"), element("i"), element("span")];
    const button = element(
      "button",
      { class: "tag-ask", type: "button", tabindex: -1, hidden: true, onClick: () => onRequest(i) },
      translate("Ask"),
    );
    const tag = element("div", { class: "tag", hidden: true }, letter, name, limb, button);
    layer.append(tag);
    return { name, letter, limb, button, tag, says: "", sizes: [] as Size[] };
  });
  /** What is not to be covered. */
  let kept: readonly ScreenBox[] = [];
  const invitation = element("div", { class: "tag invitation", hidden: true }, translate("Take a hand"));
  layer.append(invitation);
  let invited: { size: Size; side: number } | null = null;
  return {
    render(limbs, bars, faces, now, chosen = 0) {
      setAttribute(layer, "data-several", limbs.length > LIMBS.length);
      const labels = tags.map((one, i) => {
        const { holder = null, requestedByMe: asked = false } = limbs[i] ?? {};
        const bar = bars[i];
        if (!holder || !bar) return null;
        const { tag, name, letter, limb, button } = one;
        // written, and its sizes asked for, which lays the page out, only where what it says is new
        const says = `${limbs.length}\n${holder.name}\n${holder.colour}\n${asked}\n${holder.mine}`;
        if (one.says !== says || one.sizes.some((size) => size.width === 0)) {
          setText(name, holder.name);
          setText(letter, initialOf(holder.name));
          // whose limb it is the string shows that it hangs by
          setText(limb, asked ? translate("asked") : limbName(i, 1, translator));
          button.hidden = holder.mine || asked;
          tag.style.setProperty("--colour", `var(--holder-${holder.colour})`);
          tag.hidden = false;
          one.sizes = TAG_FORMS.map((written) => {
            tag.dataset.written = written;
            return { width: tag.offsetWidth, height: tag.offsetHeight };
          });
          one.says = says;
        }
        return { bar, sizes: one.sizes, rank: holder.mine ? 0 : performerOfLimb(i) === chosen ? 1 : 2 };
      });
      kept = invited || labels.some(Boolean) ? [...faces, ...getObstacles()] : [];
      laid = layOutLabels(labels, kept, laid, { width, height, top }, now);
      tags.forEach(({ tag }, i) => {
        const { box = null, size = 0 } = laid[i] ?? {};
        if (tag.hidden !== !box) tag.hidden = !box;
        if (!box) return;
        if (tag.dataset.written !== TAG_FORMS[size]) tag.dataset.written = TAG_FORMS[size];
        tag.style.transform = `translate(${box.left.toFixed(1)}px, ${box.top.toFixed(1)}px)`;
      });
    },
    invite(place) {
      if (!place) {
        invitation.hidden = true;
        invited = null;
        return;
      }
      if (!invited || invited.size.width === 0) {
        invitation.hidden = false;
        invited = { size: { width: invitation.offsetWidth, height: invitation.offsetHeight }, side: 0 };
      }
      const taken = [...kept, ...laid.flatMap((one) => one?.box ?? [])];
      const found = placeBeside(
        place,
        INVITATION_DISTANCE_PX,
        invited.size,
        taken,
        { width, height, top },
        invited.side,
      );
      if (invitation.hidden !== !found) invitation.hidden = !found;
      if (!found) return;
      invited.side = found.side;
      invitation.style.transform = `translate(${found.box.left.toFixed(1)}px, ${found.box.top.toFixed(1)}px)`;
    },
  };
}
