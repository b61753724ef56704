/** A page at a running server, that has its first answer and made no complaint. */

import { test as base, expect, type Page } from "@playwright/test";

import type { Vector } from "../src/model/wire";
import { Server } from "./server";

export const test = base.extend<{ retina: Page }, { server: Server }>({
  server: [
    async ({}, use) => {
      const server = new Server();
      await server.start();
      await use(server);
      await server.kill();
    },
    { scope: "worker" },
  ],
  retina: async ({ page, server }, use) => {
    const complaints: string[] = [];
    page.on("pageerror", (error) => complaints.push(error.message));
    page.on("console", (message) => {
      if (message.type() !== "error") return;
      // A refused pose and a killed server are what some tests are about; the browser notes both.
      if (/status of (422|503)|ERR_CONNECTION|ERR_EMPTY/.test(message.text())) return;
      complaints.push(message.text());
    });
    await open(page, server);
    await use(page);
    expect(complaints).toEqual([]);
  },
});

/** Opens a pose and waits for its answer. */
export async function open(page: Page, server: Server, hash = ""): Promise<void> {
  await page.goto("about:blank");
  await page.goto(`${server.url}/${hash}`);
  await settled(page);
}

/** Waits until the answer to the newest settings is on screen. */
export async function settled(page: Page): Promise<void> {
  await page.waitForFunction(() => window.retina?.settled);
}

export async function inWindow(page: Page, point: Vector): Promise<{ x: number; y: number }> {
  return page.evaluate((at) => window.retina.inWindow(at), point);
}

export { expect };
