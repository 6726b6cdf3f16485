import { expect, test } from "vitest";
import { isLoopback } from "../../../src/ui/crowd/qr-picture";

test("phones cannot reach links to the loopback", () => {
  const links = ["http://127.0.0.1:8000/?session=s", "http://localhost/", "http://[::1]:8000/"];
  expect(links.map(isLoopback)).toEqual([true, true, true]);
  expect(["http://192.168.1.20:8000/", "https://stage.example/", "http://127.stage.example/"].map(isLoopback)).toEqual([
    false,
    false,
    false,
  ]);
});
