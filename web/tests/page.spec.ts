/** The page as a whole: server lost and regained, keys alone, links, files, sizes, light and dark. */

import { readFile } from "node:fs/promises";

import { expect, open, settled, test } from "./fixture";

test("the server goes and comes back, and the page with it", async ({ retina, server }) => {
  await server.kill();
  await retina.locator("#view").focus();
  await retina.keyboard.press("ArrowRight");
  await expect(retina.locator("#banner")).toContainText("server is gone");
  await expect(retina.locator("#connection")).toHaveText("server gone");
  await server.start();
  await expect(retina.locator("#connection")).toHaveText("connected");
  await expect(retina.locator("#banner")).toBeHidden();
  await settled(retina);
  expect(await retina.evaluate(() => window.retina.request?.needle.tip_mm[0])).toBeCloseTo(0.14, 6);
});

test("an idle page notices that the server went", async ({ retina, server }) => {
  await server.kill();
  await expect(retina.locator("#connection")).toHaveText("server gone");
  await server.start();
  await expect(retina.locator("#connection")).toHaveText("connected");
});

test("everything by keys alone", async ({ retina }) => {
  await retina.keyboard.press("Tab");
  for (const key of ["ArrowLeft", "ArrowUp", "s", "s", "]", ".", "r", "n", "v", "x"]) {
    await retina.keyboard.press(key);
  }
  await settled(retina);
  const now = await retina.evaluate(() => window.retina.settings);
  expect(now).toMatchObject({ xMm: 0.1, yMm: -0.03, tiltDeg: 18, leanDeg: 93, rollDeg: 3 });
  expect(now.forceMn).toBeGreaterThan(0.8);
  expect(now.layers.normals).toBe(true);
  expect(now.quantity).toBe("curvature");
  await retina.keyboard.press("?");
  await expect(retina.locator(".keys")).toBeInViewport();
});

test("a link holds the pose", async ({ retina, server }) => {
  await open(
    retina,
    server,
    "#x=-0.2&y=0.3&force=0.5&tilt=30&gauge=27G&tip=bevelled&colour=strain",
  );
  await retina.keyboard.press("ArrowRight");
  await settled(retina);
  await expect.poll(() => retina.url()).toContain("x=-0.18");
  const [before, url] = [await retina.evaluate(() => window.retina.settings), retina.url()];
  await retina.goto("about:blank");
  await retina.goto(url);
  await settled(retina);
  expect(await retina.evaluate(() => window.retina.settings)).toEqual(before);
});

test("request and answer, surface and view are saved", async ({ retina }) => {
  const saved = async (key: string): Promise<Buffer> => {
    const [download] = await Promise.all([
      retina.waitForEvent("download"),
      retina.keyboard.press(key),
    ]);
    return readFile(await download.path());
  };
  const { request, answer } = JSON.parse((await saved("j")).toString()) as Record<string, unknown>;
  expect(request).toEqual(await retina.evaluate(() => window.retina.request));
  expect(answer).toEqual(await retina.evaluate(() => window.retina.answer));
  const ply = (await saved("y")).toString();
  expect(ply).toMatch(/^ply\nformat ascii 1.0\n/);
  expect(ply).toContain("element vertex 64");
  expect(ply.trim().split("\n").slice(-98)).toEqual(expect.arrayContaining(["3 0 1 9"]));
  const png = await saved("p");
  expect(png.subarray(1, 4).toString()).toBe("PNG");
  expect(png.length).toBeGreaterThan(20_000);
});

for (const [name, width, height, colorScheme] of [
  ["laptop-light", 1280, 720, "light"],
  ["laptop-dark", 1280, 720, "dark"],
  ["phone-light", 390, 844, "light"],
  ["phone-dark", 390, 844, "dark"],
] as const) {
  test(`nothing is cut off or overlaps: ${name}`, async ({ retina, server }) => {
    await retina.setViewportSize({ width, height });
    await retina.emulateMedia({ colorScheme });
    await open(retina, server);
    await expect(retina.locator("#readout")).toContainText("round trip");
    const [scrolls, overlaps] = await retina.evaluate(() => {
      const boxes = ["readout", "legend", "hint"].map((id) =>
        document.getElementById(id)?.getBoundingClientRect(),
      );
      const meet = (p: DOMRect, q: DOMRect): boolean =>
        p.left < q.right && q.left < p.right && p.top < q.bottom && q.top < p.bottom;
      const pairs = boxes.flatMap((p, i) => boxes.slice(i + 1).map((q) => p && q && meet(p, q)));
      const { scrollWidth, clientWidth } = document.documentElement;
      return [scrollWidth > clientWidth, pairs.includes(true)];
    });
    expect([scrolls, overlaps]).toEqual([false, false]);
    await retina.screenshot({ path: `artefacts/${name}.png` });
  });
}
