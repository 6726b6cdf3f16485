/** Finishes of the puppet's materials: one shader, with these values per vertex. */

/** Pattern that the shader adds to the colour. */
export const PATTERN = { plain: 0, face: 1, asanoha: 2, weave: 3, stripe: 4 } as const;

/**
 * Parts of the mesh with a material of their own in software rendering, by its index. A fragment takes the time of all
 * patterns that it could have: that of the face, the longest one, is left to the triangles of the face.
 */
export const MATERIAL_PARTS = ["faceless", "face"] as const;
export type MaterialPart = (typeof MATERIAL_PARTS)[number];

export interface Finish {
  /** sRGB hex. */
  colour: string;
  roughness: number;
  metalness?: number;
  clearcoat?: number;
  /** Strength of the wood grain, 0..1. */
  wood?: number;
  pattern?: number;
}

export const FINISH = {
  limb: { colour: "#cda679", roughness: 0.5, clearcoat: 0.22, wood: 1 },
  jointBall: { colour: "#6e4228", roughness: 0.38, clearcoat: 0.5, wood: 0.7 },
  gofun: { colour: "#f1e8d8", roughness: 0.42, clearcoat: 0.35 },
  face: { colour: "#f1e8d8", roughness: 0.42, clearcoat: 0.35, pattern: PATTERN.face },
  throat: { colour: "#e3d3bd", roughness: 0.42, clearcoat: 0.35 },
  hand: { colour: "#f1e8d8", roughness: 0.44, clearcoat: 0.3 },
  hair: { colour: "#0b0a0b", roughness: 0.28, clearcoat: 0.9 },
  hairTie: { colour: "#c4351f", roughness: 0.4, clearcoat: 0.5 },
  gold: { colour: "#d2a656", roughness: 0.26, metalness: 1 },
  cord: { colour: "#d9b25f", roughness: 0.35, metalness: 0.7 },
  kimono: { colour: "#1d3263", roughness: 0.72, pattern: PATTERN.asanoha },
  collar: { colour: "#16244f", roughness: 0.7 },
  innerCollar: { colour: "#efe7d8", roughness: 0.6 },
  hakama: { colour: "#26242c", roughness: 0.74, pattern: PATTERN.stripe },
  hakamaPlain: { colour: "#26242c", roughness: 0.74 },
  obi: { colour: "#9e2619", roughness: 0.5, clearcoat: 0.15, pattern: PATTERN.weave },
  obiPlain: { colour: "#9e2619", roughness: 0.5, clearcoat: 0.15 },
  lining: { colour: "#b3301f", roughness: 0.6 },
  piping: { colour: "#b3301f", roughness: 0.55 },
  whiteCord: { colour: "#ece4d4", roughness: 0.62 },
  tabi: { colour: "#ece5d6", roughness: 0.62 },
} as const satisfies Record<string, Finish>;
