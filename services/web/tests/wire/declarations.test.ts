import { expect, test } from "vitest";
import asyncapi from "../../../../proto/asyncapi.json";
import { isMapType } from "../../src/wire/map-message";
import { MESSAGE_TYPES } from "../../src/wire/messages";
import { MULTI_PERFORMER_OVERLAY_TYPE } from "../../src/wire/overlay";

const declared = Object.values(asyncapi.components.messages);

test("message types are those of the AsyncAPI document", () => {
  expect(Object.fromEntries(declared.map((message) => [message.name, message["x-type"]]))).toEqual(MESSAGE_TYPES);
  expect(asyncapi.components.messages.Overlay["x-type-several-performers"]).toBe(MULTI_PERFORMER_OVERLAY_TYPE);
});

test("exactly the messages with a MessagePack payload are decoded as maps", () => {
  for (const message of declared)
    expect(isMapType(message["x-type"])).toBe(message.contentType === "application/msgpack");
});
