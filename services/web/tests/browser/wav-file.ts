/** Encode channels of samples (-1 to 1) as a WAV file with 16 bits per sample. */
export function encodeWav(channels: readonly Float32Array[], rate: number): Uint8Array<ArrayBuffer> {
  const frames = channels[0].length;
  const size = frames * channels.length * 2;
  const file = Buffer.from(new ArrayBuffer(44 + size));
  file.write("RIFF", 0);
  file.writeUInt32LE(36 + size, 4);
  file.write("WAVEfmt ", 8);
  file.writeUInt32LE(16, 16);
  file.writeUInt16LE(1, 20);
  file.writeUInt16LE(channels.length, 22);
  file.writeUInt32LE(rate, 24);
  file.writeUInt32LE(rate * channels.length * 2, 28);
  file.writeUInt16LE(channels.length * 2, 32);
  file.writeUInt16LE(16, 34);
  file.write("data", 36);
  file.writeUInt32LE(size, 40);
  for (let frame = 0, at = 44; frame < frames; frame++) {
    for (const channel of channels)
      at = file.writeInt16LE(Math.round(Math.max(-1, Math.min(1, channel[frame])) * 32767), at);
  }
  return file;
}
