import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { pack, unpack } from "../../src/wire/codec";
import { MalformedMessage } from "../../src/wire/errors";
import type { Message, Presence } from "../../src/wire/messages";
import { decodeBase64, loadVectors } from "../golden-vectors";
import { HostileInputCounts } from "../hostile-input";

interface MessageVectors {
  valid: { name: string; type: number; fields: Record<string, unknown>; bytes: string }[];
  older: (MessageVectors["valid"][number] & { why: string })[];
  tolerated: MessageVectors["older"];
  skipped: string[];
  invalid: { why: string; bytes: string }[];
}

const golden = loadVectors<MessageVectors>("messages");

/** Converts a golden field to the client's form. */
function decodeField(value: unknown): unknown {
  if (Array.isArray(value)) return value.map(decodeField);
  if (typeof value !== "object" || value === null) return value;
  if ("base64" in value) return decodeBase64(value.base64 as string);
  return Object.fromEntries(Object.entries(value).map(([key, inner]) => [key, decodeField(inner)]));
}

function toMessage({ name, fields }: MessageVectors["valid"][number]): Message {
  const read = decodeField(fields) as Record<string, unknown>;
  if (name === "Overlay") {
    const frame = (limbs: Record<string, number[]>) =>
      new Map(Object.entries(limbs).map(([limb, v]) => [Number(limb), Int16Array.from(v)]));
    read.limbs = frame(read.limbs as Record<string, number[]>);
    read.earlier = (read.earlier as Record<string, number[]>[]).map(frame);
  }
  if (name === "Live") {
    const blocks = Object.entries(read.blocks as Record<string, { age_us: number; data: Uint8Array }>);
    read.blocks = new Map(blocks.map(([performer, { age_us: ageUs, data }]) => [Number(performer), { ageUs, data }]));
  }
  if (name === "Sample") read.rotations = Int16Array.from(read.rotations as number[]);
  return { name, ...read } as unknown as Message;
}

describe("golden messages", () => {
  test.each(golden.valid)("$name $bytes", (vector) => {
    const data = decodeBase64(vector.bytes);
    expect(data[0]).toBe(vector.type);
    expect(unpack(data)).toEqual(toMessage(vector));
    expect(unpack(pack(toMessage(vector)))).toEqual(toMessage(vector));
    // JavaScript does not distinguish 60.0 from 60, so the numbers of a Description may be encoded differently
    if (vector.name !== "Description") expect(pack(toMessage(vector))).toEqual(data);
  });

  test.each([...golden.older, ...golden.tolerated])("decodes: $why", (vector) => {
    expect(unpack(decodeBase64(vector.bytes))).toEqual(toMessage(vector));
  });

  test.each(golden.skipped)("skips %s", (data) => {
    expect(unpack(decodeBase64(data))).toBeNull();
  });

  test.each(golden.invalid)("refuses: $why", (vector) => {
    expect(() => unpack(decodeBase64(vector.bytes))).toThrow(MalformedMessage);
  });
});

test("the error names the field and the expected form", () => {
  const data = pack({ name: "Grant", limb: 16, epoch: 1 });
  expect(() => unpack(data)).toThrow("Grant, limb: expected a limb, 0..15");
});

test("asks has one list per limb, for any number of performers", () => {
  const presence = (limbs: number, asks: number): Message => ({
    name: "Presence",
    live: null,
    bonds: null,
    crowd: null,
    props: null,
    viewers: 1,
    puppeteers: [],
    limbs: Array.from({ length: limbs }, () => null),
    asks: Array.from({ length: asks }, () => ["a"]),
  });
  for (const limbs of [4, 8, 12, 16]) {
    expect(unpack(pack(presence(limbs, limbs)))).toEqual(presence(limbs, limbs));
    for (const asks of [0, limbs - 1, limbs + 1, limbs + 4])
      expect(() => unpack(pack(presence(limbs, asks)))).toThrow("Presence, asks: expected a list for each limb");
    const { asks: _, ...older } = presence(limbs, 0) as Presence;
    expect(unpack(pack(older as Message))).toEqual({ ...older, asks: Array.from({ length: limbs }, () => []) });
  }
});

test("a bond has two limbs of 0..15", () => {
  const bond = (limbs: number[]): Message => ({ name: "Bond", limbs, wanted: true });
  expect(unpack(pack(bond([0, 5])))).toEqual(bond([0, 5]));
  for (const limbs of [[], [0], [0, 1, 4]])
    expect(() => unpack(pack(bond(limbs)))).toThrow("Bond, limbs: expected two limbs");
  expect(() => unpack(pack(bond([0, 16])))).toThrow("Bond, limbs: expected a limb, 0..15");
});

test("live performer has a number of 0..3, an id and a name", () => {
  const presence = (entry: object): Message =>
    ({
      name: "Presence",
      viewers: 1,
      puppeteers: [],
      limbs: [],
      asks: [],
      live: [entry],
      bonds: null,
      crowd: null,
      props: null,
    }) as unknown as Message;
  const valid = presence({ performer: 3, id: "p", name: "Aiko" });
  expect(unpack(pack(valid))).toEqual(valid);
  expect(() => unpack(pack(presence({ performer: 4, id: "p", name: "Aiko" })))).toThrow(
    "Presence, live: expected a performer, 0..3",
  );
  expect(() => unpack(pack(presence({ performer: 0, id: "p" })))).toThrow("Presence, live: expected text");
});

test("unknown keys are skipped", () => {
  const claim = { name: "Claim", limb: 2, later: "added" } as Message;
  expect(unpack(pack(claim))).toEqual({ name: "Claim", limb: 2 });
});

test("arbitrary bytes are decoded, skipped or malformed", () => {
  const outcome = new HostileInputCounts(MalformedMessage);
  const types = fc.constantFrom(
    ...Array.from({ length: 16 }, (_, i) => i),
    63,
    64,
    65,
    66,
    67,
    68,
    69,
    70,
    71,
    72,
    255,
  );
  fc.assert(
    fc.property(types, fc.uint8Array({ maxLength: 80 }), (type, rest) => {
      outcome.run(() => unpack(Uint8Array.of(type, ...rest)));
    }),
    { numRuns: 3000 },
  );
  outcome.print("messages");
});

test("golden messages with a changed byte throw only MalformedMessage", () => {
  const outcome = new HostileInputCounts(MalformedMessage);
  fc.assert(
    fc.property(fc.constantFrom(...golden.valid), fc.nat(), fc.nat(255), (vector, where, value) => {
      const data = decodeBase64(vector.bytes);
      data[1 + (where % (data.length - 1))] = value;
      outcome.run(() => unpack(data));
    }),
    { numRuns: 3000 },
  );
  outcome.print("golden messages with a changed byte");
});

test("samples read back unchanged", () => {
  const real = fc.float({ min: -100, max: 100, noNaN: true });
  const rotations = fc.array(fc.integer({ min: -32768, max: 32767 }), { minLength: 54, maxLength: 54 });
  fc.assert(
    fc.property(
      fc.nat(0xffffffff),
      fc.integer({ min: 0, max: Number.MAX_SAFE_INTEGER }),
      fc.tuple(real, real, real),
      rotations,
      (sequence, sampled, root, numbers) => {
        const sample: Message = { name: "Sample", sequence, sampled, root, rotations: Int16Array.from(numbers) };
        expect(pack(sample)).toHaveLength(136);
        expect(unpack(pack(sample))).toEqual(sample);
      },
    ),
  );
});

test("inputs and pings read back unchanged", () => {
  const whole = fc.integer({ min: 0, max: Number.MAX_SAFE_INTEGER });
  const u32 = fc.nat(0xffffffff);
  const real = fc.float({ noNaN: true, noDefaultInfinity: true });
  fc.assert(
    fc.property(
      fc.nat(15),
      fc.nat(1),
      u32,
      u32,
      whole,
      fc.tuple(real, real, real),
      (limb, kind, epoch, sequence, sampled, values) => {
        const input: Message = { name: "Input", limb, kind, epoch, sequence, sampled, values };
        expect(unpack(pack(input))).toEqual(input);
        const ping: Message = { name: "Ping", sequence, sent: sampled };
        expect(pack(ping)).toHaveLength(32);
        expect(unpack(pack(ping))).toEqual(ping);
      },
    ),
  );
});
