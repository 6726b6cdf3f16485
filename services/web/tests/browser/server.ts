/** Servers for browser tests: `bunraku up` on a free port with a temporary data folder. */
import { spawn, spawnSync } from "node:child_process";
import { cpSync, existsSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";

const REPOSITORY = resolve(import.meta.dirname, "../../../..");

export interface ServerOptions {
  /** Put the demo's motion on the stage. */
  demo?: boolean;
  /** Key that signs access tokens. Without it, every client has full access. */
  secret?: string;
  /** Other origins whose pages may use the server, separated by commas. */
  origins?: string;
}

export interface RunningServer {
  url: string;
  stop(): Promise<void>;
}

/** Start a server and resolve once it accepts requests. */
export async function startServer(options: ServerOptions = {}): Promise<RunningServer> {
  const data = mkdtempSync(join(tmpdir(), "bunraku-browser-"));
  const folder = process.env["BUNRAKU_DEMO_DATA"];
  if (options.demo && folder) cpSync(await createDemoData(folder), data, { recursive: true });
  return runServer(data, options, () => rmSync(data, { recursive: true, force: true }));
}

/**
 * Return a data folder that contains the encoded demo, within `folder`. All test files of a run share it, because
 * encoding the demo takes as long as seven server starts.
 */
async function createDemoData(folder: string): Promise<string> {
  const demoData = join(folder, "made");
  if (!existsSync(demoData)) {
    const data = mkdtempSync(join(folder, "making-"));
    await (await runServer(data, { demo: true })).stop();
    cpSync(data, demoData, { recursive: true });
  }
  return demoData;
}

/** Run a server that stores its data in `data`, and call `onStopped` once it has exited. */
async function runServer(
  data: string,
  { demo = false, secret = "", origins = "" }: ServerOptions,
  onStopped: () => void = () => undefined,
): Promise<RunningServer> {
  const options = ["up", "--port", "0", "--data", data, ...(demo ? ["--demo"] : [])];
  const server = spawn(join(REPOSITORY, ".venv/bin/bunraku"), options, {
    stdio: ["ignore", "pipe", "inherit"],
    env: { ...process.env, COLUMNS: "200", NO_COLOR: "1", BUNRAKU_SECRET: secret, BUNRAKU_ORIGINS: origins },
  });
  const exited = new Promise<void>((resolve) => server.once("exit", () => resolve()));
  const url = await new Promise<string>((resolve, reject) => {
    let output = "";
    server.stdout.on("data", (chunk: Buffer) => {
      output += chunk.toString();
      const address = /is at (http:\S+?)\/?\s/.exec(output);
      if (address?.[1]) resolve(address[1]);
    });
    void exited.then(() => reject(new Error(`bunraku up exited before it printed its address. Output: ${output}`)));
  });
  return {
    url,
    async stop() {
      server.kill("SIGINT");
      await exited;
      onStopped();
    },
  };
}

/** Create an access token of a server with this secret, as its operator does. */
export function makeToken(secret: string, role: string): string {
  const result = spawnSync(join(REPOSITORY, ".venv/bin/bunraku"), ["token", "--role", role], {
    env: { ...process.env, BUNRAKU_SECRET: secret },
    encoding: "utf8",
  });
  if (result.status !== 0) throw new Error(`bunraku token failed: ${result.stderr}`);
  return result.stdout.trim();
}

/** Return the folder of recorded clips beside the repository (or `BUNRAKU_SHARED`), or null if it does not exist. */
export function sharedClipFolder(): string | null {
  const folder = process.env["BUNRAKU_SHARED"] ?? resolve(REPOSITORY, "../shared");
  return existsSync(join(folder, "mocap/bvh")) ? folder : null;
}
