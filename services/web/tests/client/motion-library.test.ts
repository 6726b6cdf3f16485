import { afterEach, expect, test, vi } from "vitest";
import { Access } from "../../src/client/access";
import type { UploadProgress } from "../../src/client/api";
import { editMotion, fetchThumbnail, updateMotion } from "../../src/client/motion-library";
import { ProblemError } from "../../src/client/problem";

afterEach(() => void vi.unstubAllGlobals());

/** Answer requests by `respond`; return them as "METHOD path" with their bodies. */
function stubServer(respond: (request: string) => Response | Promise<Response>): [string, unknown][] {
  const requests: [string, unknown][] = [];
  vi.stubGlobal("fetch", async (path: string, { method = "GET", body }: RequestInit) => {
    requests.push([`${method} ${path}`, body ? JSON.parse(String(body)) : null]);
    return respond(`${method} ${path}`);
  });
  return requests;
}

test("name and tags are changed separately", async () => {
  const requests = stubServer(() => Response.json({ id: "a/b" }));
  await updateMotion("a/b", { name: "鷺" });
  await updateMotion("a/b", { tags: [] });
  expect(requests).toEqual([
    ["PATCH /v1/motions/a%2Fb", { name: "鷺" }],
    ["PATCH /v1/motions/a%2Fb", { tags: [] }],
  ]);
});

test("edit reports the server's progress until it has a motion", async () => {
  let finish: (response: Response) => void = () => {};
  const made = new Promise<Response>((resolve) => (finish = resolve));
  const requests = stubServer((request) =>
    request.startsWith("POST") ? made : Response.json({ stage: "encoding", share: 0.5 }),
  );
  const reported: UploadProgress[] = [];
  const editing = editMotion("a", { start: 5, mirror: true }, (progress) => {
    reported.push(progress);
    finish(Response.json({ id: "new" }));
  });
  expect((await editing).id).toBe("new");
  expect(reported[0]).toEqual({ stage: "encoding", share: 0.5 });
  const [request, body] = requests.find(([path]) => path.startsWith("POST"))!;
  expect(request).toMatch(/^POST \/v1\/motions\/a\/edits\?upload=[0-9a-f]{32}$/);
  expect(body).toEqual({ start: 5, mirror: true });
  expect(requests.some(([path]) => path === `GET /v1/uploads/${request.split("=")[1]}`)).toBe(true);
});

test("problem of an edit is thrown", async () => {
  stubServer(() => Response.json({ title: "Nothing to edit", detail: "d", field: "start" }, { status: 422 }));
  await expect(editMotion("a", {})).rejects.toThrow(ProblemError);
});

test("aborted edit rejects", async () => {
  vi.stubGlobal("fetch", (_: string, { signal }: RequestInit) => {
    signal?.throwIfAborted();
    return Promise.resolve(Response.json({ id: "new" }));
  });
  await expect(editMotion("a", { loop: true }, undefined, AbortSignal.abort())).rejects.toThrow();
});

test("thumbnail is fetched from the access's server with its token", async () => {
  let seen: [string, RequestInit] | null = null;
  vi.stubGlobal("fetch", (path: string, options: RequestInit) => {
    seen = [path, options];
    return Promise.resolve(new Response("<svg/>", { headers: { "Content-Type": "image/svg+xml" } }));
  });
  const picture = await fetchThumbnail("m", new Access("https://stage.example", "a.e30.c"));
  expect(seen![0]).toBe("https://stage.example/v1/motions/m/thumbnail");
  expect(seen![1].headers).toEqual({ Authorization: "Bearer a.e30.c" });
  expect([picture.type, await picture.text()]).toEqual(["image/svg+xml", "<svg/>"]);
});
