/**
 * Decoding of MediaPipe's `NormalizedLandmarkList` and `LandmarkList` (Protocol Buffers): repeated field 1, a message
 * of the 32-bit floats x (1), y (2), z (3), visibility (4) and presence (5). Pure.
 */
import { LANDMARK_COUNT, LANDMARK_STRIDE } from "./landmark";

/** Wire types of Protocol Buffers: variable-length integer, 64 bits, length-delimited, 32 bits. */
const [VARINT, FIXED64, BYTES, FIXED32] = [0, 1, 2, 5];
const LANDMARK_FIELD = 1;
const VISIBILITY_FIELD = 4;

/**
 * Return x, y, z and visibility of the 33 landmarks (132 numbers).
 *
 * @throws RangeError if the data is not a list of 33 landmarks
 */
export function decodeLandmarkList(data: Uint8Array): Float64Array {
  const landmarks = new Float64Array(LANDMARK_COUNT * LANDMARK_STRIDE);
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  let count = 0;
  for (const [field, start, end] of readFields(view, 0, data.length)) {
    if (field !== LANDMARK_FIELD) continue;
    if (count < LANDMARK_COUNT)
      for (const [name, at, after] of readFields(view, start, end))
        if (name <= VISIBILITY_FIELD && after - at === 4)
          landmarks[count * LANDMARK_STRIDE + name - 1] = view.getFloat32(at, true);
    count++;
  }
  if (count !== LANDMARK_COUNT) throw new RangeError(`Expected ${LANDMARK_COUNT} landmarks, got ${count}.`);
  return landmarks;
}

/** Yield number, start and end of each field of the message from `start` to `end`. */
function* readFields(
  view: DataView,
  start: number,
  end: number,
): Generator<[field: number, start: number, end: number]> {
  let at = start;
  const readVarint = () => {
    let value = 0;
    for (let shift = 0; shift < 32; shift += 7) {
      const byte = view.getUint8(at++);
      value |= (byte & 127) << shift;
      if (byte < 128) return value >>> 0;
    }
    throw new RangeError("A number of the landmark list is too long.");
  };
  while (at < end) {
    const tag = readVarint();
    const type = tag & 7;
    if (type === VARINT) {
      readVarint();
      continue;
    }
    const length = type === BYTES ? readVarint() : type === FIXED32 ? 4 : type === FIXED64 ? 8 : NaN;
    if (!(at + length <= end)) throw new RangeError("The landmark list is truncated, or has a field of unknown type.");
    yield [tag >>> 3, at, at + length];
    at += length;
  }
}
