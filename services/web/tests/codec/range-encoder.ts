/** Encodes bits as the specification defines, in big integers: the stream is the lowest number of the last interval. */
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
  for (let i = bytes - 1; i >= 0; i--, low >>= 8n) out[i] = Number(low & 255n);
  let end = bytes;
  while (end > 0 && out[end - 1] === 0) end--;
  return out.subarray(0, end);
}
