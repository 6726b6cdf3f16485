/** Line icons on a 20 px grid, and icons of the four limbs on a 24 px grid. */
import { shape } from "./dom";

const PATHS = {
  link:
    "M8.5 11.5a2.8 2.8 0 0 0 4 0l2.8-2.8a2.8 2.8 0 0 0-4-4L10 6M11.5 8.5a2.8 2.8 0 0 0-4 0l-2.8 2.8" +
    "a2.8 2.8 0 0 0 4 4L10 14",
  pad:
    "M6 6h8c2.2 0 3.5 2 3.9 4.9.3 2.3-.2 3.6-1.6 3.6-1.6 0-2.2-2.2-3.7-2.2H7.4" +
    "c-1.5 0-2.1 2.2-3.7 2.2-1.4 0-1.9-1.300-1.6-3.6C2.500 8 3.800 6 6 6zM6.300 8v2.400M5.100 9.200h2.400" +
    "M13.200 8.600h.01M14.800 10h.01",
  close: "M5.500 5.500l9 9M14.500 5.500l-9 9",
  upload: "M10 13V4.500M6.500 8L10 4.500L13.500 8M4 13.500v2h12v-2",
  pause: "M7 5v10M13 5v10",
  play: "M7 4.800v10.400l8-5.200z",
  loop:
    "M4 9.500a4 4 0 0 1 4-4h7M12.800 3.200l2.300 2.300l-2.300 2.300M16 10.500a4 4 0 0 1-4 4H5M7.200 12.200" +
    "l-2.300 2.300l2.300 2.300",
  download: "M10 4.500V13M6.500 9.500L10 13L13.500 9.500M4 13.500v2h12v-2",
  picture: "M3.500 4.500h13v11h-13zM5 14l3.500-4l2.500 2.700l1.800-1.700L15.500 14M12.800 7.500h.01",
  camera: "M3 6.500h8.500v7H3zM11.500 9l5-2.500v7l-5-2.500",
  sound:
    "M3.500 8v4h3l4 3.500v-11L6.500 8zM13.200 7.600a3.400 3.400 0 0 1 0 4.800M15.400 5.400" +
    "a6.500 6.500 0 0 1 0 9.200",
  silent: "M3.500 8v4h3l4 3.500v-11L6.500 8zM13.500 8l4 4M17.500 8l-4 4",
  library: "M4 4.500v11M7.500 4.500v11M11 4.800l3.800 10.500",
  strings:
    "M3.500 4.500h13M10 2.500v4M5 4.500v9.500M15 4.500v9.500M10 6.500v5.500M4 15.500a1 1 0 1 0 2 0" +
    "a1 1 0 1 0-2 0M14 15.500a1 1 0 1 0 2 0a1 1 0 1 0-2 0M9 13.500a1 1 0 1 0 2 0a1 1 0 1 0-2 0",
  line: "M2.500 11h3l2-5l3.500 9l2.500-6l1 2h3",
  keep: "M6 3.500h8v13l-4-3.300l-4 3.300z",
  left: "M12.500 4.500L7 10l5.500 5.500",
  right: "M7.500 4.500L13 10l-5.500 5.500",
  up: "M4.500 12.500L10 7l5.500 5.500",
  down: "M4.500 7.500L10 13l5.500-5.500",
  add: "M10 5.500v9M5.500 10h9",
  // The letter あ, drawn because a font with it may be missing.
  hiragana:
    "M4 5.800c3.700 .5 8 .3 12-.6M9 3c-.6 3.700-.6 8.800 .6 13M13.200 7.800c-1 3.900-4 8.200-6.800 8.200" +
    "c-3.500 0-2.600-6.500 4.500-6.500c4 0 5.600 1.900 5.600 3.700c0 2.300-2 3.600-4.500 4",
  edit: "M4 16l.8-3.400L13.200 4.200a1.600 1.600 0 0 1 2.400 2.400L7.400 15.200zM11.700 5.700l2.500 2.500",
  bin: "M4.500 6h11M8 6V4.200h4V6M6 6l.7 9.800h6.600L14 6M8.700 8.500v4.800M11.300 8.500v4.800",
} as const;

export type IconName = keyof typeof PATHS | "theme";

export function icon(name: IconName): SVGSVGElement {
  const svg = shape("svg", { class: "icon", viewBox: "0 0 20 20", "aria-hidden": "true" });
  if (name === "theme") {
    svg.append(
      shape("circle", { cx: 10, cy: 10, r: 6.2 }),
      shape("path", { d: "M10 3.800a6.200 6.200 0 0 1 0 12.400z", fill: "currentColor", stroke: "none" }),
    );
  } else {
    svg.append(shape("path", { d: PATHS[name], ...(name === "play" ? { fill: "currentColor" } : {}) }));
  }
  return svg;
}

/** Strokes of a small dancer, seen from the audience: the figure's left limbs are on the right. */
const BODY = "M12 6.500v7.500";
const RAISED_LIMBS = [
  "M12 8.500L17.500 5",
  "M12 8.500L6.500 5",
  "M12 14L16 16.600L15.200 21",
  "M12 14L8 16.600L8.800 21",
];
const RESTING_LIMBS = ["M12 8.500L16.800 12", "M12 8.500L7.200 12", "M12 14L15 21", "M12 14L9 21"];
const RAISED_LIMB_TIPS = [
  [18.3, 4.5],
  [5.7, 4.5],
  [16.6, 16.6],
  [7.4, 16.6],
];

/** Draw the dancer with one limb highlighted: 0 left hand, 1 right hand, 2 left leg, 3 right leg. */
export function limbIcon(limb: number): SVGSVGElement {
  const svg = shape("svg", { class: "icon", viewBox: "0 0 24 24", "aria-hidden": "true" });
  const rest = [BODY, ...RESTING_LIMBS.filter((_, other) => other !== limb)].join("");
  svg.append(
    shape("circle", { cx: 12, cy: 4.2, r: 2.1 }),
    shape("path", { d: rest, opacity: 0.38 }),
    shape("path", { d: RAISED_LIMBS[limb], "stroke-width": 2 }),
    shape("circle", {
      cx: RAISED_LIMB_TIPS[limb][0],
      cy: RAISED_LIMB_TIPS[limb][1],
      r: 1.7,
      fill: "currentColor",
      stroke: "none",
    }),
  );
  return svg;
}

/** Draw a small dancing figure for a motion. The pose is derived from the motion's id. */
export function motionGlyph(id: string): SVGSVGElement {
  let seed = 7;
  for (const letter of id) seed = (seed * 31 + (letter.codePointAt(0) ?? 0)) % 65521;
  const pick = (low: number, high: number) => {
    seed = (seed * 75 + 74) % 65537;
    return low + (seed % (high - low + 1));
  };
  const limbs = [
    [pick(7, 10), pick(-9, 7)],
    [-pick(7, 10), pick(-9, 7)],
  ].map(([x, y]) => `M22 17l${x} ${y}`);
  const d = `M22 15v10${limbs.join("")}M22 25l${pick(2, 8)} 11M22 25l${-pick(2, 8)} 11`;
  return shape(
    "svg",
    { viewBox: "0 0 44 44", "aria-hidden": "true" },
    shape("circle", { cx: 22, cy: 11, r: 3.4 }),
    shape("path", { d }),
  );
}
