/** Finishes of the props, beside those of the puppet. */
import { FINISH, type Finish } from "../puppet/finish";

export const PROP_FINISH = {
  vermilion: { colour: "#b3301f", roughness: 0.62 },
  vermilionInside: { colour: "#c2543c", roughness: 0.8 },
  paper: { colour: "#efe4cf", roughness: 0.7 },
  goldLeaf: { colour: "#d9ab56", roughness: 0.42, metalness: 0.85 },
  gold: FINISH.gold,
  lacquer: { colour: "#120d0c", roughness: 0.3, clearcoat: 0.9 },
  bamboo: { colour: "#b98d56", roughness: 0.55 },
  darkBamboo: { colour: "#5a3a22", roughness: 0.55 },
  indigo: { colour: "#1d3263", roughness: 0.7 },
  white: { colour: "#efe7d8", roughness: 0.6 },
  bark: { colour: "#3a261d", roughness: 0.85 },
  blossom: { colour: "#f3c3c6", roughness: 0.6 },
  blossomHeart: { colour: "#d2603f", roughness: 0.6 },
  bud: { colour: "#d9667a", roughness: 0.6 },
} as const satisfies Record<string, Finish>;
