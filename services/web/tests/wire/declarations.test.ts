import { expect, test } from "vitest";
import asyncapi from "../../../../proto/asyncapi.json";
import { CLIENT_MAP_FIELDS, SERVER_MAP_FIELDS } from "../../src/wire/map-message";
import { MESSAGE_TYPES } from "../../src/wire/messages";
import { MULTI_PERFORMER_OVERLAY_TYPE } from "../../src/wire/overlay";

const declared = Object.values(asyncapi.components.messages);

test("message types are those of the AsyncAPI document", () => {
  expect(Object.fromEntries(declared.map((message) => [message.name, message["x-type"]]))).toEqual(MESSAGE_TYPES);
  expect(asyncapi.components.messages.Overlay["x-type-several-performers"]).toBe(MULTI_PERFORMER_OVERLAY_TYPE);
});

test("exactly the messages with a MessagePack payload are decoded as maps", () => {
  const names = (isClient: boolean) =>
    declared
      .filter(({ contentType, "x-type": type }) => contentType === "application/msgpack" && type >= 64 === isClient)
      .map(({ name }) => name);
  expect(Object.keys(SERVER_MAP_FIELDS).sort()).toEqual(names(false).sort());
  expect(Object.keys(CLIENT_MAP_FIELDS).sort()).toEqual(names(true).sort());
});
