import { expect, test } from "vitest";
import { captureCommand } from "../../../src/ui/library/performer-guide";

test("command names the server, the session if there is one, and a token if one is needed", () => {
  const server = "https://stage.example";
  expect(captureCommand(server, { session: "s1", needsToken: false })).toBe(
    "bunraku capture vmc --server https://stage.example --session s1",
  );
  expect(captureCommand(server, { session: null, needsToken: true })).toBe(
    "bunraku capture vmc --server https://stage.example --token TOKEN",
  );
});
