/** Servers for browser tests: `bunraku up` on a free port. */
import { spawn, spawnSync } from "node:child_process";
import { existsSync, mkdtempSync, rmSync } from "node:fs";
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
  /** Wait longer than any test for puppeteers who are silent, as a page is while it compiles shaders in software. */
  isPatient?: boolean;
}

/** Program of a patient server. */
const PATIENT_SERVER = `
from bunraku.marionette import ownership
from bunraku.session import stage_endpoint
ownership.INPUT_TIMEOUT_US = stage_endpoint.PUPPETEER_TIMEOUT_US = 3_600_000_000
from bunraku.cli import app
app()
`;

export interface RunningServer {
  url: string;
  stop(): Promise<void>;
}

/** Start a server with a temporary data folder and resolve once it accepts requests. */
export async function startServer({
  demo = false,
  secret = "",
  origins = "",
  isPatient = false,
}: ServerOptions = {}): Promise<RunningServer> {
  const data = mkdtempSync(join(tmpdir(), "bunraku-browser-"));
  const options = ["up", "--port", "0", "--data", data, ...(demo ? ["--demo"] : [])];
  const [program, main] = isPatient ? ["python", ["-c", PATIENT_SERVER]] : ["bunraku", []];
  const server = spawn(join(REPOSITORY, ".venv/bin", program), [...main, ...options], {
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
      rmSync(data, { recursive: true, force: true });
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
