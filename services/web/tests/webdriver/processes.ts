/** Processes of browsers, displays and speakers. */
import { type ChildProcess, spawn } from "node:child_process";
import { existsSync, rmSync } from "node:fs";
import { createServer } from "node:net";
import { delimiter, join } from "node:path";
import { createInterface } from "node:readline";
import type { Readable } from "node:stream";

/** Return the path of an installed program, or null if there is none. */
export function findProgram(name: string): string | null {
  const folders = (process.env["PATH"] ?? "").split(delimiter);
  return folders.map((folder) => join(folder, name)).find((path) => existsSync(path)) ?? null;
}

/** Start a program. Its descriptor 3 is a pipe. `isGroup`: the program and what it starts are a process group. */
export function startProcess(
  program: string,
  args: string[],
  env: NodeJS.ProcessEnv = {},
  { isGroup = false } = {},
): ChildProcess {
  const started = spawn(program, args, {
    stdio: ["ignore", "pipe", "pipe", "pipe"],
    env: { ...process.env, ...env },
    detached: isGroup,
  });
  if (isGroup) {
    const kill = () => signalGroup(started);
    process.once("exit", kill);
    started.once("exit", () => process.off("exit", kill));
  }
  return started;
}

function signalGroup({ pid }: ChildProcess): void {
  if (pid === undefined) return;
  try {
    process.kill(-pid, "SIGKILL");
  } catch (error) {
    // All have ended.
    if ((error as NodeJS.ErrnoException).code !== "ESRCH") throw error;
  }
}

/** Kill a program and everything that it has started. */
export async function killProcessGroup(started: ChildProcess): Promise<void> {
  const hasExited = started.pid === undefined || started.exitCode !== null || started.signalCode !== null;
  const exited = hasExited ? null : new Promise((resolve) => started.once("exit", resolve));
  signalGroup(started);
  await exited;
}

/** Return the first match of `pattern` in the lines of `output`. Rejects if the process ends before. */
export function findInOutput(started: ChildProcess, output: Readable, pattern: RegExp): Promise<string> {
  const program = started.spawnfile;
  return new Promise((resolve, reject) => {
    const lines: string[] = [];
    createInterface(output).on("line", (line) => {
      const found = pattern.exec(line)?.[1];
      if (found !== undefined) resolve(found);
      else if (lines.length < 50) lines.push(line);
    });
    started.once("error", reject);
    started.once("exit", (code) =>
      reject(new Error(`${program} exited with ${code} before it printed ${pattern}. Output: ${lines.join("\n")}`)),
    );
  });
}

/** Time after which a program that does not end is killed, in milliseconds. */
const STOP_TIMEOUT_MS = 20_000;

/** End a program. */
export async function stopProcess(started: ChildProcess): Promise<void> {
  if (started.pid === undefined || started.exitCode !== null || started.signalCode !== null) return;
  const exited = new Promise((resolve) => started.once("exit", resolve));
  started.kill();
  const timeout = setTimeout(() => started.kill("SIGKILL"), STOP_TIMEOUT_MS);
  await exited;
  clearTimeout(timeout);
}

/** Remove the folder of a browser that has ended. Its last processes may still write while they end. */
export function removeFolder(folder: string): void {
  rmSync(folder, { recursive: true, force: true, maxRetries: 20, retryDelay: 100 });
}

/** Return a TCP port that is free now. */
export function findFreePort(): Promise<number> {
  return new Promise((resolve, reject) => {
    const server = createServer();
    server.once("error", reject);
    server.listen(0, "127.0.0.1", () => {
      const address = server.address();
      server.close(() => resolve(typeof address === "object" && address ? address.port : 0));
    });
  });
}

/** A display in memory. */
export interface VirtualDisplay {
  /** Value of `DISPLAY`. */
  readonly name: string;
  stop(): Promise<void>;
}

export async function startVirtualDisplay(): Promise<VirtualDisplay> {
  const server = startProcess("Xvfb", ["-displayfd", "3", "-screen", "0", "1024x800x24", "-nolisten", "tcp"]);
  const number = await findInOutput(server, server.stdio[3] as Readable, /^(\d+)$/);
  return { name: `:${number}`, stop: () => stopProcess(server) };
}

/** A speaker that nobody hears, whose clock runs as that of a sound card. */
export interface VirtualSpeaker {
  /** Value of `PULSE_SERVER`. */
  readonly address: string;
  stop(): Promise<void>;
}

/** Start a sound server whose files are in `folder`. */
export async function startVirtualSpeaker(folder: string): Promise<VirtualSpeaker> {
  const socket = join(folder, "pulse.socket");
  const server = startProcess(
    "pulseaudio",
    [
      ...["-n", "--daemonize=no", "--use-pid-file=no", "--exit-idle-time=-1", "--log-level=info"],
      ...["-L", "module-null-sink", "-L", `module-native-protocol-unix socket=${socket} auth-cookie-enabled=0`],
    ],
    { HOME: folder, PULSE_RUNTIME_PATH: folder, LC_ALL: "C" },
  );
  await findInOutput(server, server.stderr as Readable, /(Daemon startup complete)/);
  return { address: `unix:${socket}`, stop: () => stopProcess(server) };
}
