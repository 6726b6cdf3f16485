/**
 * Naming conventions of joints, from `proto/joint_names.json`, which the server's readers of motions use too
 * (`bunraku.motion.naming.naming_profile`). Patterns are words without a side; `|` separates alternatives, the first
 * choice first.
 */
import document from "../../../../../proto/joint_names.json";

export type SideWords = readonly [left: string, right: string];

/** Naming convention of one family of skeletons. */
export interface NamingProfile {
  readonly name: string;
  /** The convention's own words for left and right, which decide between profiles with the same names. */
  readonly sideWords: SideWords;
  /** Patterns by H-Anim joint. */
  readonly trunk: Readonly<Record<string, string>>;
  /** Patterns by H-Anim joint without "l_" or "r_". */
  readonly limbs: Readonly<Record<string, string>>;
  /** Regular expression that a name of the skeleton must match; empty for none. */
  readonly marker: string;
}

/** Words for left and right. */
export const SIDE_WORDS = document.side_words as unknown as readonly SideWords[];

/** Joints of a leg, then those of an arm. */
export const LEG_JOINTS: readonly string[] = document.limb_joints.slice(0, 4);
export const ARM_JOINTS: readonly string[] = document.limb_joints.slice(4);

export const PROFILES: readonly NamingProfile[] = document.profiles.map(({ side_words, ...profile }) => ({
  ...profile,
  trunk: profile.trunk as Readonly<Record<string, string>>,
  sideWords: side_words as unknown as SideWords,
}));
