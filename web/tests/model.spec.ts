/** The page's own arithmetic, without a browser. */

import { expect, test } from "@playwright/test";

import { roundUp, scaleFor } from "../src/colour/scale";
import { decades, frontier, place, valueAt } from "../src/model/cost";
import { meanCurvature, surfaceStrain } from "../src/model/fields";
import { NewestWins } from "../src/model/newest";
import { orientation, shaftDirection } from "../src/model/needle_pose";
import { withNumbers } from "../src/model/paths";
import { INITIAL, type Settings } from "../src/model/settings";
import { nodeErrors, statistics } from "../src/model/statistics";
import { fromHash, toHash } from "../src/model/url";
import type { CostStanding, Surface, Triangle, Vector } from "../src/model/wire";

/** A grid with the given height and normal. */
function grid(
  height: (x: number, y: number) => number,
  normal: (x: number, y: number) => Vector,
): Surface {
  const places = [0, 1, 2, 3].flatMap((j) =>
    [0, 1, 2, 3].map((i) => [0.3 * i - 0.45, 0.3 * j - 0.45]),
  );
  const triangles = [0, 1, 2].flatMap((j) =>
    [0, 1, 2].flatMap((i): Triangle[] => {
      const at = 4 * j + i;
      return [
        [at, at + 1, at + 5],
        [at, at + 5, at + 4],
      ];
    }),
  );
  const points = places as [number, number][];
  return {
    vertices_mm: points.map(([x, y]) => [x, y, height(x, y)]),
    normals: points.map(([x, y]) => normal(x, y)),
    triangles,
    displacement_um: points.map(() => 0),
  };
}

const plane = grid(
  () => 0,
  () => [0, 0, 1],
);

test("the curvature of a bowl is one over its radius, of a dome its negative", () => {
  const radius = 12;
  const bowl = (sign: number): Surface =>
    grid(
      (x, y) => sign * (radius - Math.sqrt(radius * radius - x * x - y * y)),
      (x, y) => [
        (-sign * x) / radius,
        (-sign * y) / radius,
        Math.sqrt(1 - (x * x + y * y) / radius ** 2),
      ],
    );
  for (const curvature of meanCurvature(bowl(1))) expect(curvature).toBeCloseTo(1 / radius, 4);
  for (const curvature of meanCurvature(bowl(-1))) expect(curvature).toBeCloseTo(-1 / radius, 4);
  for (const curvature of meanCurvature(plane)) expect(curvature).toBeCloseTo(0, 12);
});

test("a stretched and turned surface has its stretch as strain", () => {
  const [cos, sin] = [Math.cos(0.7), Math.sin(0.7)];
  const stretched = plane.vertices_mm.map(([x, y]): Vector => [1.1 * x * cos, y, 1.1 * x * sin]);
  const strain = surfaceStrain({ ...plane, vertices_mm: stretched }, plane);
  for (const value of strain) expect(value).toBeCloseTo(0.1, 9);
  for (const value of surfaceStrain(plane, plane)) expect(value).toBeCloseTo(0, 9);
});

test("the orientation takes the needle's +z to its shaft", () => {
  for (const [tilt, lean, roll] of [
    [0, 0, 0],
    [15, 30, 0],
    [60, -120, 45],
  ] as const) {
    const [x, y, z, w] = orientation(tilt, lean, roll);
    expect(Math.hypot(x, y, z, w)).toBeCloseTo(1, 12);
    const turned = [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)];
    shaftDirection(tilt, lean).forEach((part, axis) => expect(turned[axis]).toBeCloseTo(part, 12));
  }
});

test("errors are distances, and their statistics nearest-rank", () => {
  const errors = nodeErrors(
    [
      [0, 0, 0.001],
      [0, 0, 0],
    ],
    [
      [0, 0, 0],
      [0, 0.003, 0.004],
    ],
  );
  expect(errors[0]).toBeCloseTo(1, 12);
  expect(errors[1]).toBeCloseTo(5, 12);
  const many = Array.from({ length: 64 }, (_, index) => index + 1);
  expect(statistics(many)).toEqual({ meanUm: 32.5, p99Um: 64, maxUm: 64 });
});

test("settings survive the URL", () => {
  const settings: Settings = {
    ...INITIAL,
    scene: "fovea",
    gauge: "41G",
    tip: "bevelled",
    xMm: -0.1234,
    forceMn: 0.05,
    along: "inward",
    accuracy: { max_time_ms: 3 },
    effects: ["elasticity", "contact"],
    quantity: "strain",
    layers: { ...INITIAL.layers, normals: true, rest: false },
    parameters: { "scene.tissue.choroid.youngs_modulus_kpa": 12.5 },
  };
  expect(fromHash(`#${toHash(settings)}`)).toEqual(settings);
  for (const effects of ["all", []] as const) {
    const other: Settings = { ...INITIAL, effects: effects === "all" ? effects : [...effects] };
    expect(fromHash(`#${toHash(other)}`)).toEqual(other);
  }
  expect(fromHash("")).toEqual(INITIAL);
  expect(toHash(INITIAL)).toBe("");
  expect(fromHash("#x=nonsense&tip=spoon&force=1")).toEqual({ ...INITIAL, forceMn: 1 });
});

test("numbers are put into a copy of the scene", () => {
  const scene = { tissue: { choroid: { thickness_mm: 0.25 } } };
  const changed = withNumbers(scene, [
    ["scene.tissue.choroid.thickness_mm", 0.3],
    ["scene.a.b", 1],
  ]);
  expect(changed).toEqual({ tissue: { choroid: { thickness_mm: 0.3 } }, a: { b: 1 } });
  expect(scene.tissue.choroid.thickness_mm).toBe(0.25);
});

test("scales end at round numbers and do not flicker", () => {
  expect([0.8, 1, 114.9, 160, 700].map(roundUp)).toEqual([1, 1, 150, 200, 700]);
  const first = scaleFor("displacement", [0, 114], undefined);
  expect(first).toEqual({ min: 0, max: 150 });
  expect(scaleFor("displacement", [0, 80], first)).toEqual(first);
  expect(scaleFor("displacement", [0, 20], first)).toEqual({ min: 0, max: 20 });
  expect(scaleFor("curvature", [-3, 1], undefined)).toEqual({ min: -3, max: 3 });
});

test("newest wins: one question at a time, those between are left out, a slow one is given up", async () => {
  const [asked, taken]: [number[], number[]] = [[], []];
  let atOnce = 0;
  const loop = new NewestWins<number, number>(
    (question, signal) => {
      asked.push(question);
      expect(++atOnce).toBe(1);
      return new Promise((resolve) => {
        const done = (): void => {
          atOnce--;
          clearTimeout(timer);
          resolve(question);
        };
        const timer = setTimeout(done, question === 99 ? 60_000 : 20);
        signal.addEventListener("abort", done);
      });
    },
    (answer) => taken.push(answer),
    100,
  );
  for (const question of [1, 2, 3]) loop.offer(question);
  await expect.poll(() => loop.idle).toBe(true);
  expect([asked, taken]).toEqual([
    [1, 3],
    [1, 3],
  ]);
  loop.offer(99);
  loop.offer(4);
  await expect.poll(() => taken).toEqual([1, 3, 4]);
  expect(asked).toEqual([1, 3, 99, 4]);
});

test("the chart's axes are logarithmic, and its frontier is beaten by none", () => {
  const axis = { from: 0.1, to: 1000, start: 200, end: 0 };
  expect(place(axis, 10)).toBeCloseTo(100, 9);
  expect(valueAt(axis, place(axis, 7.3))).toBeCloseTo(7.3, 9);
  expect(place(axis, 1e9)).toBe(0);
  expect(decades(axis)).toHaveLength(5);
  const standing = (name: string, median_um: number, median_ms: number): CostStanding => ({
    name,
    knob: "level",
    failed: 0,
    median_um,
    p99_um: median_um,
    median_ms,
    p99_ms: median_ms,
  });
  const all = [standing("slow", 0.5, 100), standing("beaten", 3, 20), standing("fast", 2, 10)];
  expect(frontier(all).map(({ name }) => name)).toEqual(["fast", "slow"]);
});
