import { expect, test } from "vitest";
import { packViewerMessage, unpackServerMessage, type ViewerMessage } from "../../src/wire/client-codec";
import { pack, unpack } from "../../src/wire/codec";
import { MalformedMessage } from "../../src/wire/errors";
import { decodeBase64, loadVectors } from "../golden-vectors";

interface Vector {
  name: string;
  type: number;
  bytes: string;
}

const golden = loadVectors<{ valid: Vector[]; invalid: { bytes: string }[] }>("messages");

test("golden messages of servers are decoded as by the codec of all messages, those of clients skipped", () => {
  for (const { type, bytes } of golden.valid) {
    const data = decodeBase64(bytes);
    expect(unpackServerMessage(data)).toEqual(type < 64 ? unpack(data) : null);
  }
  expect(() => unpackServerMessage(new Uint8Array())).toThrow(MalformedMessage);
  expect(unpackServerMessage(Uint8Array.of(63, 1))).toBeNull();
});

test("invalid messages of servers are refused", () => {
  const invalid = golden.invalid.map(({ bytes }) => decodeBase64(bytes)).filter(([type]) => type < 64);
  expect(invalid.length).toBeGreaterThan(10);
  for (const data of invalid) expect(() => unpackServerMessage(data)).toThrow(MalformedMessage);
});

test("messages of viewers and puppeteers are encoded as by the codec of all messages", () => {
  const sent = golden.valid.filter(({ type, name }) => type >= 64 && name !== "Sample");
  expect(sent.length).toBeGreaterThan(10);
  for (const { bytes } of sent) {
    const message = unpack(decodeBase64(bytes)) as ViewerMessage;
    expect(packViewerMessage(message)).toEqual(pack(message));
  }
});
