/** Name tags of limb holders on the stage, each with an "Ask" button, and the invitation beside a hand. */
import { pageTranslator, type Translator } from "../../i18n/translator";
import { LIMBS } from "../../motion/skeleton";
import type { ScreenBox } from "../../stage/camera/screen-box";
import { MAX_LIMBS, performerOfLimb } from "../../wire/limbs";
import { element, setAttribute, setText } from "../dom";
import { initialOf } from "../format";
import { type LimbState, limbName } from "../limb-state";
import { type LabelPlacement, layOutLabels, placeBeside, type Side, type Size } from "./tag-layout";

export interface ScreenPoint {
  x: number;
  y: number;
}

export interface NameTags {
  /**
   * Place each holder's tag beside the bar of its string, where it covers no other tag, bar or face. Boxes are in CSS
   * pixels, a bar of null hides its tag, and `now` is in milliseconds. Tags of this page's user are placed first, then
   * those of the `selected` performer.
   */
  render(
    limbs: readonly LimbState[],
    bars: readonly (ScreenBox | null)[],
    faces: readonly ScreenBox[],
    now: number,
    selected?: number,
  ): void;
  /** Show the invitation beside a point, clear of the tags; null hides it. */
  invite(point: ScreenPoint | null): void;
}

/** Upper limit of tags on the page: the middle of the header. */
const TOP_MARGIN_PX = 32;
/** Forms of a tag from the longest to the shortest: name, limb and "Ask"; the name alone; its initial. */
const TAG_FORMS = ["whole", "name", "initial"] as const;
/** Distance between the hand and the invitation. */
const INVITATION_DISTANCE_PX = 26;

export interface NameTagOptions {
  /** Upper limit of tags, in CSS pixels. */
  top?: number;
  /** Return the boxes of other elements that cover the picture. */
  getObstacles?: () => readonly ScreenBox[];
  translator?: Translator;
}

/**
 * Create the layer of tags over the whole picture. `onRequest` is called for a press on "Ask". Tags are hidden from
 * assistive technology: the strings panel offers the same.
 */
export function createNameTags(
  root: ParentNode & Node,
  onRequest: (limb: number) => void,
  { top = TOP_MARGIN_PX, getObstacles = () => [], translator = pageTranslator }: NameTagOptions = {},
): NameTags {
  const { translate } = translator;
  const layer = element("div", { class: "tags", "aria-hidden": "true" });
  root.append(layer);
  // Observed instead of measured, since measuring would force a layout every frame. Zero while a sheet hides the layer.
  let [width, height] = [0, 0];
  let placements: (LabelPlacement | null)[] = [];
  new ResizeObserver(([{ contentRect }]) => {
    if (contentRect.width === 0) return;
    // Another size may use other fonts: place and measure all tags anew.
    [width, height, placements] = [contentRect.width, contentRect.height, []];
    for (const tag of tags) tag.content = "";
  }).observe(layer);
  const tags = Array.from({ length: MAX_LIMBS }, (_, i) => {
    const [name, letter, limb] = [element("b", { dir: "auto" }), element("i"), element("span")];
    const button = element(
      "button",
      { class: "tag-ask", type: "button", tabindex: -1, hidden: true, onClick: () => onRequest(i) },
      translate("Ask"),
    );
    const root = element("div", { class: "tag", hidden: true }, letter, name, limb, button);
    layer.append(root);
    return { name, letter, limb, button, root, content: "", sizes: [] as Size[] };
  });
  /** Boxes that tags must not cover, those of the faces among them, and those of the bars. */
  let obstacles: readonly ScreenBox[] = [];
  let faceBoxes: readonly ScreenBox[] = [];
  let barBoxes: readonly ScreenBox[] = [];
  const invitation = element("div", { class: "tag invitation", hidden: true }, translate("Take a hand"));
  layer.append(invitation);
  let invitationState: { size: Size; side: Side | null } | null = null;
  return {
    render(limbs, bars, faces, now, selected = 0) {
      setAttribute(layer, "data-several", limbs.length > LIMBS.length);
      const labels = tags.map((tag, i) => {
        const { holder = null, requestedByMe = false } = limbs[i] ?? {};
        const bar = bars[i];
        if (!holder || !bar) return null;
        const { root, name, letter, limb, button } = tag;
        // Measuring forces a layout, so it is only done when the content changed.
        const content = `${limbs.length}\n${holder.name}\n${holder.colour}\n${requestedByMe}\n${holder.mine}`;
        if (tag.content !== content || tag.sizes.some((size) => size.width === 0)) {
          setText(name, holder.name);
          setText(letter, initialOf(holder.name));
          // The performer is not named: the string shows it.
          setText(limb, requestedByMe ? translate("asked") : limbName(i, 1, translator));
          button.hidden = holder.mine || requestedByMe;
          root.style.setProperty("--colour", `var(--holder-${holder.colour})`);
          root.hidden = false;
          tag.sizes = TAG_FORMS.map((form) => {
            root.dataset.written = form;
            return { width: root.offsetWidth, height: root.offsetHeight };
          });
          tag.content = content;
        }
        return { bar, sizes: tag.sizes, rank: holder.mine ? 0 : performerOfLimb(i) === selected ? 1 : 2 };
      });
      faceBoxes = faces;
      barBoxes = labels.flatMap((label) => label?.bar ?? []);
      obstacles = invitationState || labels.some(Boolean) ? [...faces, ...getObstacles()] : [];
      placements = layOutLabels(labels, obstacles, placements, { width, height, top }, now);
      tags.forEach(({ root }, i) => {
        const { box = null, size = 0 } = placements[i] ?? {};
        if (root.hidden !== !box) root.hidden = !box;
        if (!box) return;
        if (root.dataset.written !== TAG_FORMS[size]) root.dataset.written = TAG_FORMS[size];
        root.style.transform = `translate(${box.left.toFixed(1)}px, ${box.top.toFixed(1)}px)`;
      });
    },
    invite(point) {
      if (!point) {
        invitation.hidden = true;
        invitationState = null;
        return;
      }
      if (!invitationState || invitationState.size.width === 0) {
        invitation.hidden = false;
        invitationState = { size: { width: invitation.offsetWidth, height: invitation.offsetHeight }, side: null };
      }
      const taken = [...obstacles, ...barBoxes, ...placements.flatMap((placement) => placement?.box ?? [])];
      const { size, side } = invitationState;
      const sides = sidesAwayFrom(faceBoxes, point);
      const placed = placeBeside(point, INVITATION_DISTANCE_PX, size, taken, { width, height, top }, side, sides);
      if (invitation.hidden !== !placed) invitation.hidden = !placed;
      if (!placed) return;
      invitationState.side = placed.side;
      invitation.style.transform = `translate(${placed.box.left.toFixed(1)}px, ${placed.box.top.toFixed(1)}px)`;
    },
  };
}

/** Return the sides of a hand at `point`, the best first: towards the performer, whose face is nearest, is the worst. */
function sidesAwayFrom(faces: readonly ScreenBox[], { x }: ScreenPoint): readonly Side[] {
  const offsets = faces.map(({ left, right }) => x - (left + right) / 2);
  const nearest = offsets.sort((a, b) => Math.abs(a) - Math.abs(b))[0] ?? 0;
  return nearest >= 0 ? [0, 2, 3, 1] : [1, 2, 3, 0];
}
