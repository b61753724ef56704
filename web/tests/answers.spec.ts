/** Levels, comparison, effects, refusals: what the server says is what the page says. */

import type { Locator } from "@playwright/test";

import { expect, open, settled, test } from "./fixture";

test("a level is switched by its button and by its key", async ({ retina }) => {
  const level = (): Promise<string | undefined> =>
    retina.evaluate(() => window.retina.answer?.accuracy.level);
  expect(await level()).toBe("linear");
  await retina.locator("label", { hasText: /^coarse$/ }).click();
  await expect.poll(level).toBe("coarse");
  await expect(retina.locator(".facts")).toContainText("coarse");
  await retina.locator("#view").focus();
  await retina.keyboard.press("1");
  await expect.poll(level).toBe("linear");
});

test("compare shows the true error of every level, node by node", async ({ retina }) => {
  const levels = await retina.evaluate(
    async (): Promise<unknown[]> =>
      ((await (await fetch("/v1/levels")).json()) as { levels: unknown[] }).levels,
  );
  await retina.locator("#compare").click();
  const rows = retina.locator("#comparison tbody tr");
  await expect(rows).toHaveCount(levels.length, { timeout: 60_000 });
  await expect(rows.last()).toContainText("reference");
  await retina.locator("label", { hasText: /^error$/ }).click();
  const { errors, linear } = await retina.evaluate(() => ({
    errors: window.retina.errorsUm ?? [],
    linear: window.retina.comparison?.rows.find(({ level }) => level === "linear"),
  }));
  expect(errors).toHaveLength(64);
  expect(linear?.errors.maxUm).toBeCloseTo(Math.max(...errors), 6);
  expect(linear?.errors.maxUm).toBeGreaterThan(0.5);
  expect(linear?.errors.meanUm).toBeLessThan(linear?.errors.maxUm ?? 0);
  await expect(retina.locator("#legend")).toContainText("Error, µm");
  await retina.screenshot({ path: "artefacts/error.png" });
  await retina.keyboard.press("s");
  await settled(retina);
  expect(await retina.evaluate(() => window.retina.errorsUm)).toBeUndefined();
});

test("the chart shows what accuracy costs, and choosing a point chooses the setting", async ({
  retina,
  server,
}) => {
  const asked = (): Promise<unknown> => retina.evaluate(() => window.retina.settings.accuracy);
  const level = (name: string): Locator =>
    retina.locator("#cost").getByRole("button", { name: new RegExp(`^Level ${name}`) });
  const height = async (circle: Locator): Promise<number> =>
    Number(await circle.getAttribute("cy"));
  const measured = async (name: string): Promise<number> => height(level(name).locator("circle"));
  // Finite elements take longer, and time runs upwards.
  expect(await measured("coarse")).toBeLessThan((await measured("network")) - 20);
  await level("coarse").click();
  await settled(retina);
  expect(await asked()).toEqual({ level: "coarse" });
  const answer = await retina.evaluate(() => window.retina.answer);
  expect(answer?.accuracy.level).toBe("coarse");
  // The ring stands where this one answer took as long as it says, however long that was.
  const decade = async (ms: string): Promise<number> => {
    // The axis of time is drawn after that of the error, which has the same numbers.
    const number = retina.locator("#cost text").filter({ hasText: new RegExp(`^${ms}$`) });
    return Number(await number.last().getAttribute("y"));
  };
  const [one, ten] = [await decade("1"), await decade("10")];
  const tookMs = (answer?.time_us.total ?? 0) / 1e3;
  const baseline = 4;
  const ring = retina.locator("#cost-now circle");
  await expect(ring).toHaveCount(1);
  await expect
    .poll(() => height(ring))
    .toBeCloseTo(one - baseline + (ten - one) * Math.log10(tookMs), 0);
  await retina.locator("#cost").screenshot({ path: "artefacts/cost.png" });
  // A place between the points asks for a tolerance: the middle of the axis from 0.1 to 200 µm.
  const plane = await retina.locator("#cost .plane").boundingBox();
  if (!plane) throw new Error("no plane");
  await retina.mouse.click(plane.x + plane.width / 2, plane.y + plane.height - 4);
  await settled(retina);
  const { max_error_um } = (await asked()) as { max_error_um: number };
  expect(max_error_um).toBeGreaterThan(4.2);
  expect(max_error_um).toBeLessThan(4.8);
  // Other requests have other measurements.
  await expect(retina.locator(".cost-chart")).toContainText("round tips");
  await open(retina, server, "#tip=flat");
  await expect(retina.locator(".cost-chart")).toContainText("flat and bevelled tips");
});

test("a puncture is refused in words, beside the force, with a way back", async ({
  retina,
  server,
}) => {
  await open(retina, server, "#gauge=41G&force=0.08");
  await retina.locator("input[type=number]").first().fill("5");
  await retina.keyboard.press("Enter");
  const banner = retina.locator("#banner");
  await expect(banner).toContainText("would puncture");
  await expect(retina.locator(".number .complaint").first()).toContainText("at most");
  await retina.getByRole("button", { name: /Set the force to/ }).click();
  await expect(banner).toBeHidden();
  expect(await retina.evaluate(() => window.retina.settings.forceMn)).toBeLessThan(0.2);
});

test("a tolerance is asked for; what the server cannot do is said in its words", async ({
  retina,
}) => {
  await retina.locator("label", { hasText: /^tolerance/ }).click();
  await settled(retina);
  const { request, problem, answer } = await retina.evaluate(() => {
    const { settings, problem, answer } = window.retina;
    return { request: settings.accuracy, problem, answer };
  });
  expect(request).toEqual({ max_error_um: 5 });
  if (problem) await expect(retina.locator("#banner")).toContainText("max_error_um");
  else expect(answer?.accuracy.expected_error_um).toBeDefined();
});

test("effects are listed with their reason, and switched", async ({ retina, server }) => {
  await open(retina, server, "#level=coarse");
  await retina.getByText("Effects", { exact: true }).click();
  const row = retina.locator(".effects li", { hasText: "finite strain" });
  await expect(row.locator(".state")).toHaveText("simulated");
  await expect(row.locator(".note")).not.toBeEmpty();
  await row.locator("input").uncheck();
  await expect(row.locator(".state")).toHaveText("not simulated");
  expect(await retina.evaluate(() => window.retina.request?.effects)).not.toContain(
    "finite_strain",
  );
});

test("effects are left to the server, all asked for, or chosen one by one", async ({
  retina,
  server,
}) => {
  await open(retina, server, "#level=coarse");
  await retina.getByText("Effects", { exact: true }).click();
  const panel = retina.locator("[data-panel=effects]");
  const asked = (): Promise<unknown> => retina.evaluate(() => window.retina.request?.effects);
  const rule = (name: string): Promise<void> =>
    panel.getByRole("radio", { name, exact: true }).check();
  await expect(panel.getByRole("radio", { name: "automatic" })).toBeChecked();
  await rule("all");
  await expect.poll(asked).toBe("all");
  await settled(retina);
  await expect(panel.locator("li", { hasText: "finite strain" })).toContainText(
    "asked for with all",
  );
  await rule("chosen");
  await settled(retina);
  const chosen = await retina.evaluate(() => window.retina.answer?.effects);
  const simulated = chosen?.filter((effect) => effect.simulated).map(({ name }) => name);
  expect(await asked()).toEqual(simulated);
  await rule("automatic");
  await expect.poll(asked).toBe("auto");
  await settled(retina);
  // Every number that was decided on is told beside what it was held against.
  const effects = (await retina.evaluate(() => window.retina.answer?.effects)) ?? [];
  const judged = effects.filter(
    ({ value, threshold }) => value !== undefined && threshold !== undefined,
  );
  expect(judged.length).toBeGreaterThan(3);
  for (const { name, reason } of judged) {
    const note = panel
      .locator("li", { hasText: name.replaceAll("_", " ") })
      .first()
      .locator(".note");
    await expect(note).toContainText(reason.replaceAll("`", "").slice(0, 20));
    await expect(note).toContainText(/\(\S+ against \S+\)/);
  }
});

test("what a scene has calls for effects, and goes with the link", async ({ retina, server }) => {
  await open(retina, server, "#level=coarse&force=0.3&tilt=0&x=0&y=0");
  await retina.getByText("Effects", { exact: true }).click();
  const panel = retina.locator("[data-panel=effects]");
  const set = async (label: string, value: string): Promise<void> => {
    await panel.getByLabel(label, { exact: true }).fill(value);
    await retina.keyboard.press("Enter");
    await settled(retina);
  };
  const state = (effect: string): ReturnType<typeof panel.locator> =>
    panel.locator("li", { hasText: effect }).first().locator(".state");
  const scene = (): Promise<Record<string, unknown>> =>
    retina.evaluate(() => (window.retina.request?.scene ?? {}) as Record<string, unknown>);
  await expect(state("bleb")).toHaveText("not simulated");
  await set("Fluid volume", "0.02");
  await set("Fluid radius", "0.6");
  await expect(state("bleb")).toHaveText("simulated");
  expect((await scene())["bleb"]).toEqual({ volume_mm3: 0.02, radius_mm: 0.6 });
  const bleb = await retina.evaluate(() => window.retina.answer?.contact.bleb);
  expect(bleb?.volume_mm3).toBeCloseTo(0.02, 5);
  expect(bleb?.pressure_mmhg).toBeGreaterThan(1);
  await expect(panel.locator("#fluid")).toContainText("mmHg");
  await panel.locator("#fluid").scrollIntoViewIfNeeded();
  await retina.screenshot({ path: "artefacts/conditions.png" });
  await expect.poll(() => retina.url()).toContain("scene.bleb.volume_mm3=0.02");
  await set("Fluid volume", "0");
  await expect(state("bleb")).toHaveText("not simulated");
  expect((await retina.evaluate(() => window.retina.request?.scene)) ?? "").toBe("macula");

  await set("Eye pressure", "30");
  await expect(state("pressure")).toHaveText("simulated");
  expect((await scene())["pressure_kpa"]).toBeCloseTo(30 * 0.133322, 3);
  await set("Friction", "0.5");
  await set("Bond strength", "1");
  const { tissue, friction_coefficient } = await scene();
  expect(friction_coefficient).toBe(0.5);
  expect(tissue).toMatchObject({ bond: { strength_kpa: 1 } });
  await expect(state("adhesion")).toHaveText("simulated");
  // Beyond a range the server says what is allowed, and the page says it beside the number.
  await set("Friction", "7");
  await expect(panel.locator(".number.wrong")).toContainText("allowed");
});

test("a number of the tissue changes the answer", async ({ retina }) => {
  const deepest = (): Promise<number> =>
    retina.evaluate(() => Math.max(...(window.retina.answer?.surface.displacement_um ?? [])));
  const before = await deepest();
  await retina.getByText("Tissue", { exact: true }).click();
  const choroid = retina.locator("[data-panel=tissue] section", { hasText: "choroid" });
  await choroid.locator("input[type=number]").nth(1).fill("60");
  await retina.keyboard.press("Enter");
  await expect.poll(deepest).toBeLessThan(0.8 * before);
});
