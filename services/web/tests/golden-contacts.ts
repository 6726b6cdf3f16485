/** Contacts of `proto/vectors/contacts.json`. */
import { ContactTrack } from "../src/codec/extension/contact";
import type { Track } from "../src/wire/messages";
import { loadVectors } from "./golden-vectors";

export interface ContactVectors {
  tracks: Track[];
  valid: { track: number; index: number; block: string; left: number[]; right: number[] }[];
  positions: { track: number; position: number; planted: [number, number] }[];
  invalid: { why: string; block: string; index: number }[];
  invalid_tracks: { why: string; track: Track }[];
}

/** Return the vectors. */
export function contactVectors(): ContactVectors {
  return loadVectors<ContactVectors>("contacts");
}

/** Return the tracks of the vectors. */
export function goldenContactTracks(): ContactTrack[] {
  return contactVectors().tracks.map((track) => ContactTrack.fromDescription(track));
}
