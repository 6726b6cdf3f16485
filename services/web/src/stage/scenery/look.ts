/** The two looks of the stage, night and day: colours and lights. */

export type Theme = "night" | "day";

export interface Look {
  dark: boolean;
  exposure: number;
  environment: number;
  backdrop: { low: string; middle: string; top: string };
  disc: { deep: string; bright: string; strength: number };
  /** Shade of the corners: displayed colour, strength at the end of the ellipse, and where it starts. */
  vignette: { colour: string; strength: number; start: number };
  /** `ambient` replaces the light of the environment map where there is none. */
  floor: { colour: string; roughness: number; opacity: number; environment: number; ambient: number };
  /** Lights: colour and intensity (candela for spots). */
  key: readonly [string, number];
  fill: readonly [string, number];
  warmRim: readonly [string, number];
  coolRim: readonly [string, number];
  /** Free strings and rings, and the colour that a held thread is lit towards. */
  threadColour: string;
  threadOpacity: number;
  ringColour: string;
  ringOpacity: number;
  /** Colours of the puppeteers in the order of joining. */
  puppeteerColours: readonly string[];
}

export const LOOKS: Readonly<Record<Theme, Look>> = {
  night: {
    dark: true,
    exposure: 1.05,
    environment: 0.72,
    backdrop: { low: "#0a0b12", middle: "#161c33", top: "#090b16" },
    disc: { deep: "#b27a2e", bright: "#e8b765", strength: 0.76 },
    vignette: { colour: "#03040a", strength: 0.55, start: 0.52 },
    floor: { colour: "#1a1411", roughness: 0.42, opacity: 0.84, environment: 0.25, ambient: 0.1 },
    key: ["#ffe4c2", 118],
    fill: ["#a9b8ea", 1.04],
    warmRim: ["#ffd9a0", 70],
    coolRim: ["#8fb0ff", 48],
    threadColour: "#e9dfc8",
    threadOpacity: 0.42,
    ringColour: "#f3ebdd",
    ringOpacity: 0.72,
    puppeteerColours: ["#ffb454", "#5cc8d6", "#c3a8ff", "#8fd694", "#ff93a5"],
  },
  day: {
    dark: false,
    exposure: 0.98,
    environment: 0.55,
    backdrop: { low: "#e9d9bb", middle: "#f6ecd9", top: "#efe3cc" },
    disc: { deep: "#dcb35c", bright: "#efd08a", strength: 0.92 },
    vignette: { colour: "#96703c", strength: 0.16, start: 0.6 },
    floor: { colour: "#d8c19a", roughness: 0.9, opacity: 0.96, environment: 0.3, ambient: 0.75 },
    key: ["#fff0d8", 95],
    fill: ["#c9d6ff", 0.4],
    warmRim: ["#fff4e0", 30],
    coolRim: ["#dfe8ff", 24],
    threadColour: "#5d5040",
    threadOpacity: 0.55,
    ringColour: "#3a3128",
    ringOpacity: 0.7,
    puppeteerColours: ["#8f5200", "#0b6673", "#6240a8", "#2c6a33", "#a52c49"],
  },
};
