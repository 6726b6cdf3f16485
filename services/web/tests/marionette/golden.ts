/** Types and content of `proto/vectors/arm.json`. */

import { loadVectors } from "../golden-vectors";

export interface GoldenArm {
  proportions: string;
  inner_radius: number;
  sha256: string;
  table: string;
  solves: { target: number[]; azimuth: number; angles: number[]; elbow: number[]; wrist: number[]; tip: number[] }[];
}

export interface GoldenLimb {
  limb: 0 | 1 | 2 | 3;
  rotations: number[][];
  target?: number[];
  angle?: number;
  own: number | number[];
  joints: number[][];
}

export interface Golden {
  arms: GoldenArm[];
  identities: { lengths: [number, number, number]; masses: [number, number, number] | null; identity: string }[];
  limbs: { offsets: number[][]; tips: number[][]; cases: GoldenLimb[] };
}

export const golden = loadVectors<Golden>("arm");
