/** The hand on the tissue: what is drawn is what the API answers. */

import { setTimeout as sleep } from "node:timers/promises";

import type { Page } from "@playwright/test";

import type { PredictResponse, Vector } from "../src/model/wire";
import { expect, inWindow, settled, test } from "./fixture";

/** How far f32 positions on the graphics card may be from the answer, mm: a tenth of a micrometre. */
const DRAWN_MM = 1e-4;

const WANTED_PER_SECOND = 30;

const distance = (p: Vector, q: Vector): number =>
  Math.hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);

async function pressAt(page: Page, point: Vector, pixels: number): Promise<void> {
  const { x, y } = await inWindow(page, point);
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x, y + pixels, { steps: 8 });
  await page.mouse.up();
  await settled(page);
}

test("a press moves the nodes to where the API says", async ({ retina, server, request }) => {
  const before = await retina.evaluate(() => window.retina.answer);
  await pressAt(retina, [-0.45, -0.3, 0.01], 60);
  const { asked, drawn } = await retina.evaluate(() => ({
    asked: window.retina.request,
    drawn: window.retina.drawnNodesMm,
  }));
  expect(asked?.needle.tip_mm[0]).toBeCloseTo(-0.45, 1);
  expect(asked?.needle.tip_mm[1]).toBeCloseTo(-0.3, 1);
  expect(Math.hypot(...(asked?.force_mn ?? []))).toBeGreaterThan(0.9);
  const reply = await request.post(`${server.url}/v1/predict`, { data: asked });
  const answer = (await reply.json()) as PredictResponse;
  expect(drawn).toHaveLength(answer.surface.vertices_mm.length);
  answer.surface.vertices_mm.forEach((node, index) => {
    expect(distance(node, drawn[index] ?? [9, 9, 9])).toBeLessThan(DRAWN_MM);
  });
  const moved = drawn.map((node, index) =>
    distance(node, before?.surface.vertices_mm[index] ?? node),
  );
  expect(Math.max(...moved)).toBeGreaterThan(0.05);
  expect(Math.max(...answer.surface.displacement_um)).toBeGreaterThan(50);
});

test("the needle's own place keeps the tip where it is", async ({ retina }) => {
  const shaft = await retina.evaluate((): Vector => {
    const [x, y, z] = window.retina.answer?.needle.tip_mm ?? [0, 0, 0];
    return [x, y + 0.2, z + 0.8];
  });
  await pressAt(retina, shaft, 40);
  const { settings } = await retina.evaluate(() => ({ settings: window.retina.settings }));
  expect([settings.xMm, settings.yMm]).toEqual([0.12, -0.05]);
  expect(settings.forceMn).toBeGreaterThan(0.9);
});

test("a drag beside the tissue turns the view and asks nothing", async ({ retina }) => {
  const corner: Vector = [1.05, -1.05, 0.09];
  const [updates, place] = [
    await retina.evaluate(() => window.retina.updates),
    await inWindow(retina, corner),
  ];
  await retina.mouse.move(60, 400);
  await retina.mouse.down();
  await retina.mouse.move(160, 430, { steps: 4 });
  await retina.mouse.up();
  const turned = await inWindow(retina, corner);
  expect(Math.hypot(turned.x - place.x, turned.y - place.y)).toBeGreaterThan(30);
  expect(await retina.evaluate(() => window.retina.updates)).toBe(updates);
});

test("at linear the answer follows the hand at 30 updates a second or more", async ({ retina }) => {
  const { x, y } = await inWindow(retina, [0, -0.3, 0.01]);
  await retina.mouse.move(x, y);
  await retina.mouse.down();
  // What else the machine does takes its share now and then; the page must reach the rate in one of these seconds.
  const seconds: { updates: number; frames: number }[] = [];
  while (seconds.length < 15 && !seconds.some(({ updates }) => updates >= WANTED_PER_SECOND)) {
    seconds.push(await rates(retina, x, y + 60));
  }
  await retina.mouse.up();
  const best = seconds.reduce((most, now) => (now.updates > most.updates ? now : most));
  const said = `${best.updates.toFixed(0)} updates/s, ${best.frames.toFixed(0)} frames/s drawn`;
  console.log(`${said}, after ${seconds.length} s`);
  expect(best.updates).toBeGreaterThanOrEqual(WANTED_PER_SECOND);
});

/** Drags for about a second, and tells how often the page took an answer and drew. */
async function rates(
  page: Page,
  x: number,
  y: number,
): Promise<{ updates: number; frames: number }> {
  const count = (): Promise<{ updates: number; frames: number; at: number }> =>
    page.evaluate(() => {
      const { updates, frames } = window.retina;
      return { updates, frames, at: performance.now() };
    });
  const first = await count();
  // A mouse tells of itself 125 times a second and waits for nobody.
  const moves: Promise<void>[] = [];
  for (const until = Date.now() + 1000; Date.now() < until; await sleep(8)) {
    moves.push(page.mouse.move(x, y + 50 * Math.sin(Date.now() / 300)));
  }
  const last = await count();
  await Promise.all(moves);
  const took = (last.at - first.at) / 1000;
  return {
    updates: (last.updates - first.updates) / took,
    frames: (last.frames - first.frames) / took,
  };
}
