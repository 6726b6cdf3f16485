/** Real servers for browser tests: `bunraku up` on a free port, keeping its things in a folder of its own. */
import { spawn, spawnSync } from "node:child_process";
import { cpSync, existsSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";

const REPOSITORY = resolve(import.meta.dirname, "../../../..");

export interface ServerOptions {
  /** Whether our own dance is on its stage. */
  demo?: boolean;
  /** What its tokens are signed with; without one it lets everybody in. */
  secret?: string;
  /** Other sites whose pages may use it, with commas between them. */
  origins?: string;
}

export interface RunningServer {
  url: string;
  stop(): Promise<void>;
}

/** Start a server; resolves once it answers. */
export async function startServer(options: ServerOptions = {}): Promise<RunningServer> {
  const data = mkdtempSync(join(tmpdir(), "bunraku-browser-"));
  const folder = process.env["BUNRAKU_DEMO_DATA"];
  if (options.demo && folder) cpSync(await createDemoData(folder), data, { recursive: true });
  return runServer(data, options, () => rmSync(data, { recursive: true, force: true }));
}

/** What a server keeps that has made our own dance: made once for all test files, within `folder`, as it takes as long as seven starts of a server. */
async function createDemoData(folder: string): Promise<string> {
  const made = join(folder, "made");
  if (!existsSync(made)) {
    const data = mkdtempSync(join(folder, "making-"));
    await (await runServer(data, { demo: true })).stop();
    cpSync(data, made, { recursive: true });
  }
  return made;
}

/** A server that keeps its things in `data`; `after` is done once it has ended. */
async function runServer(
  data: string,
  { demo = false, secret = "", origins = "" }: ServerOptions,
  after: () => void = () => undefined,
): Promise<RunningServer> {
  const options = ["up", "--port", "0", "--data", data, ...(demo ? ["--demo"] : [])];
  const server = spawn(join(REPOSITORY, ".venv/bin/bunraku"), options, {
    stdio: ["ignore", "pipe", "inherit"],
    env: { ...process.env, COLUMNS: "200", NO_COLOR: "1", BUNRAKU_SECRET: secret, BUNRAKU_ORIGINS: origins },
  });
  const ended = new Promise<void>((done) => server.once("exit", () => done()));
  const url = await new Promise<string>((found, failed) => {
    let said = "";
    server.stdout.on("data", (chunk: Buffer) => {
      said += chunk.toString();
      const address = /is at (http:\S+?)\/?\s/.exec(said);
      if (address?.[1]) found(address[1]);
    });
    void ended.then(() => failed(new Error(`the server ended before it served: ${said}`)));
  });
  return {
    url,
    async stop() {
      server.kill("SIGINT");
      await ended;
      after();
    },
  };
}

/** A token of a server with this secret, as its operator makes them. */
export function makeToken(secret: string, role: string): string {
  const made = spawnSync(join(REPOSITORY, ".venv/bin/bunraku"), ["token", "--role", role], {
    env: { ...process.env, BUNRAKU_SECRET: secret },
    encoding: "utf8",
  });
  if (made.status !== 0) throw new Error(`no token: ${made.stderr}`);
  return made.stdout.trim();
}

/** The folder of real clips beside the project, if it is there. */
export function sharedClipFolder(): string | null {
  const folder = process.env["BUNRAKU_SHARED"] ?? resolve(REPOSITORY, "../shared");
  return existsSync(join(folder, "mocap/bvh")) ? folder : null;
}
