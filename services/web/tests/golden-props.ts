/** Props of `proto/vectors/props.json`. */
import { PropTrack } from "../src/codec/extension/props";
import type { Track } from "../src/wire/messages";
import { loadVectors } from "./golden-vectors";

/** Limb and place of a prop, null while it is not on the stage. */
export type GoldenState = [number | null, number[]] | null;

/** Model of a stored prop: a GLB file, and its values. */
export interface GoldenModel {
  name: string;
  model: string;
  pitch: number;
  height: number;
  palmOffset: number;
  positions: number[];
  normals: number[];
  colours: number[];
  finishes: number[];
  indices: number[];
}

export interface PropVectors {
  tracks: Track[];
  valid: { track: number; index: number; block: string; frames: number; runs: [number, GoldenState][][] }[];
  positions: { track: number; position: number; states: GoldenState[] }[];
  models: GoldenModel[];
  invalid: { why: string; block: string; index: number }[];
  invalid_tracks: { why: string; track: Track }[];
}

/** Return the vectors. */
export function propVectors(): PropVectors {
  return loadVectors<PropVectors>("props");
}

/** Return the tracks of the vectors. */
export function goldenPropTracks(): PropTrack[] {
  return propVectors().tracks.map((track) => PropTrack.fromDescription(track));
}
