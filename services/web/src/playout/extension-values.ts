/**
 * Values of extensions (bodies, fingers, faces): the blocks that a viewer holds, and what they add to a pose. The module
 * is loaded when a motion has some.
 */

import { decodeExtensionBlock, type ExtensionBlock, ExtensionTrack } from "../codec/extension/track";
import { createExtendedPose, extendPose } from "../motion/extension";
import { EXPRESSIONS, type FacePose, faceExpressions } from "../motion/face";
import type { HandsPose } from "../motion/hands";
import { createWorldTransforms, worldTransforms } from "../motion/skeleton";
import type { Track } from "../wire/messages";
import { TrackBlockStore } from "./block-store";
import type { MotionInstant, OpenedExtension, PosePart } from "./extension-poses";

/** Decoded blocks of one extension, each at the highest level received. */
export class ExtensionBlockStore extends TrackBlockStore<ExtensionTrack, ExtensionBlock> {
  private readonly nextValues = new Float64Array(this.track.layout.count * 3);

  /**
   * Write the values at `position` of a motion of `duration` microseconds into `out`. If the block is missing, write
   * zeros and return false: the joints of a body then follow the figure alone.
   */
  valuesAt(position: number, loop: boolean, duration: number, out: Float64Array): boolean {
    const location = this.findBlock(position, loop, duration);
    if (!location) {
      out.fill(0);
      return false;
    }
    const { block, instant, following } = location;
    if (!following) {
      block.valuesAt(Math.min(Math.max(instant, -0.5), block.frames - 0.5), out);
      return true;
    }
    const { nextValues: next } = this;
    const mix = Math.min(instant - (block.frames - 1), 1);
    block.valuesAt(block.frames - 1, out);
    following.valuesAt(0, next);
    for (let n = 0; n < out.length; n++) out[n] += mix * (next[n] - out[n]);
    return true;
  }

  protected override decode(data: Uint8Array): ExtensionBlock {
    return decodeExtensionBlock(this.track, data);
  }
}

/** Return the storage of a track of values, and what writes them into poses; throw DamagedBlock. */
export function openExtension(description: Track): OpenedExtension {
  const store = new ExtensionBlockStore(ExtensionTrack.fromDescription(description));
  return { store, part: store.track.content.part, performer: store.track.performer, write: createPosePart(store) };
}

/** Return the function that writes an extension's part of a pose; it reuses its storage. */
function createPosePart(store: ExtensionBlockStore): PosePart {
  const { content, layout } = store.track;
  const values = new Float64Array(layout.count * 3);
  const read = ({ position, loop, duration }: MotionInstant) => store.valuesAt(position, loop, duration, values);
  switch (content.part) {
    case "body": {
      const world = createWorldTransforms();
      const extended = createExtendedPose(content.body);
      return (figure, pose, instant) => {
        read(instant);
        pose.extended = extendPose(figure, worldTransforms(figure, pose, world), values, extended);
      };
    }
    case "fingers": {
      const hands: HandsPose = { hands: content.hands, values };
      return (_, pose, instant) => {
        pose.hands = read(instant) ? hands : null;
      };
    }
    case "face": {
      const face: FacePose = { face: content.face, weights: new Float64Array(EXPRESSIONS.length) };
      return (_, pose, instant) => {
        pose.face = read(instant) ? face : null;
        if (pose.face) faceExpressions(face.face, values, face.weights);
      };
    }
  }
}
