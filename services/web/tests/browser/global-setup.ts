/** Set-up of a run of browser tests: an HTTP endpoint from which the workers get the shared resources. */
import { createServer } from "node:http";
import type { AddressInfo } from "node:net";
import type { TestProject } from "vitest/node";
import { type ServerKind, SharedResources } from "./shared-resources";

declare module "vitest" {
  export interface ProvidedContext {
    /** Base URL: `/server?kind=open`, `/browser?worker=1&flag=...`. */
    sharedResources: string;
  }
}

export default async function setup(project: TestProject): Promise<() => Promise<void>> {
  const resources = new SharedResources();
  const find = ({ pathname, searchParams }: URL): Promise<unknown> =>
    pathname === "/server"
      ? resources.server(searchParams.get("kind") as ServerKind)
      : resources.browser(searchParams.get("worker") ?? "", searchParams.getAll("flag"));
  const endpoint = createServer((request, response) => {
    find(new URL(request.url ?? "/", "http://127.0.0.1")).then(
      (found) => response.end(JSON.stringify(found)),
      (error: unknown) => response.writeHead(500).end(String(error)),
    );
  });
  await new Promise<void>((done) => endpoint.listen(0, "127.0.0.1", done));
  project.provide("sharedResources", `http://127.0.0.1:${(endpoint.address() as AddressInfo).port}`);
  return async () => {
    endpoint.closeAllConnections();
    endpoint.close();
    await resources.stop();
  };
}
