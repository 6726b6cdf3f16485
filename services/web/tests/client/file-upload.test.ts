import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Access } from "../../src/client/access";
import { sendFile } from "../../src/client/file-upload";
import { FakeRequest } from "./fake-request";

const file = new File(["glTF"], "sword.glb");

beforeEach(() => void vi.stubGlobal("XMLHttpRequest", FakeRequest));
afterEach(() => void vi.unstubAllGlobals());

test("a file is sent to the server of the access, with its token, and the progress is reported", async () => {
  const reported: unknown[] = [];
  const sent = sendFile("/v1/props?filename=sword.glb", file, {
    access: new Access("https://stage.example", "a.token"),
    onProgress: (share) => reported.push(share),
    onSent: () => reported.push("sent"),
  });
  const { last } = FakeRequest;
  expect(last.arguments).toEqual(["POST", "https://stage.example/v1/props?filename=sword.glb", file]);
  expect(last.headers).toEqual({ "Content-Type": "application/octet-stream", Authorization: "Bearer a.token" });
  last.upload.dispatchEvent(Object.assign(new Event("progress"), { loaded: 1, total: 4 }));
  last.upload.dispatchEvent(Object.assign(new Event("progress"), { loaded: 0, total: 0 }));
  last.upload.dispatchEvent(new Event("load"));
  last.respond(201, '{"id": "a"}');
  expect(await sent).toEqual({ id: "a" });
  expect(reported).toEqual([0.25, 0, "sent"]);
});

test("a problem of the server is that of the upload, and a rejected token is reported", async () => {
  const access = new Access("", "a.token");
  const problems: string[] = [];
  access.onUnauthorized(({ title }) => problems.push(title));
  const sent = sendFile("/v1/props", file, { access });
  FakeRequest.last.respond(401, '{"title": "No access", "detail": "the token has expired"}');
  await expect(sent).rejects.toMatchObject({ status: 401, title: "No access" });
  expect(problems).toEqual(["No access"]);
});

test("no answer, and one that is no JSON, reject the upload", async () => {
  const lost = sendFile("/v1/props", file);
  FakeRequest.last.dispatchEvent(new Event("error"));
  await expect(lost).rejects.toMatchObject({ name: "ProblemError", status: 0 });
  const odd = sendFile("/v1/props", file);
  FakeRequest.last.respond(200, "<html>");
  await expect(odd).rejects.toThrow(SyntaxError);
});

test("an aborted upload rejects with the reason", async () => {
  const cancel = new AbortController();
  const sent = sendFile("/v1/props", file, { signal: cancel.signal });
  cancel.abort(new Error("given up"));
  await expect(sent).rejects.toThrow("given up");
  await expect(sendFile("/v1/props", file, { signal: cancel.signal })).rejects.toThrow("given up");
});
