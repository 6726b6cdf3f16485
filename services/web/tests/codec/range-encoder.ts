/**
 * The range encoder of the contract, in whole numbers of any size: the stream is the lowest number of its last interval, as a
 * fraction.
 */
export function encodeBits(bits: readonly { bit: number; probability: number }[]): Uint8Array<ArrayBuffer> {
  let low = 0n,
    range = 0xffffffffn,
    bytes = 4;
  for (const { bit, probability } of bits) {
    const bound = (range >> 15n) * BigInt(probability);
    if (bit) range = bound;
    else [low, range] = [low + bound, range - bound];
    for (; range < 1n << 24n; bytes++) [low, range] = [low << 8n, range << 8n];
  }
  const out = new Uint8Array(bytes);
  for (let at = bytes - 1; at >= 0; at--, low >>= 8n) out[at] = Number(low & 255n);
  let end = bytes;
  while (end > 0 && out[end - 1] === 0) end--;
  return out.subarray(0, end);
}
