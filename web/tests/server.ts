/** The release server on a free port, that can be killed and come back. */

import { spawn, type ChildProcess } from "node:child_process";
import { existsSync } from "node:fs";
import { resolve } from "node:path";
import { setTimeout as sleep } from "node:timers/promises";

const name = process.platform === "win32" ? "retina-server.exe" : "retina-server";
const target = process.env["CARGO_TARGET_DIR"] ?? resolve(import.meta.dirname, "../../target");
const program = process.env["RETINA_PROGRAM"] ?? resolve(target, "release", name);

export class Server {
  url = "";
  private child: ChildProcess | undefined;

  /** Starts on a free port, or on the one that it had before. */
  async start(): Promise<void> {
    if (!existsSync(program)) throw new Error(`${program} is missing: cargo build --release`);
    const listen = this.url === "" ? "127.0.0.1:0" : new URL(this.url).host;
    const child = spawn(program, ["--listen", listen], { stdio: ["ignore", "ignore", "pipe"] });
    this.child = child;
    let log = "";
    child.stderr.on("data", (text: Buffer) => (log += text.toString()));
    for (let tries = 0; tries < 600; tries++) {
      const address = /listening on (http:\/\/[\d.:]+)/.exec(log)?.[1];
      if (address) this.url = address;
      if (address && (await this.ready())) return;
      if (child.exitCode !== null) break;
      await sleep(50);
    }
    throw new Error(`the server does not get ready:\n${log}`);
  }

  /** Ends it at once, as a crash would. */
  async kill(): Promise<void> {
    const { child } = this;
    if (!child || child.exitCode !== null) return;
    const gone = new Promise((resolve) => child.once("exit", resolve));
    child.kill("SIGKILL");
    await gone;
  }

  private async ready(): Promise<boolean> {
    try {
      return (await fetch(`${this.url}/readyz`)).ok;
    } catch {
      return false;
    }
  }
}
