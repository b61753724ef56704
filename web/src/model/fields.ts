/** What can be painted on the surface: one number for each node. */

import type { Surface, Vector } from "./wire";

const sub = (p: Vector, q: Vector): Vector => [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
const dot = (p: Vector, q: Vector): number => p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
const scale = (p: Vector, s: number): Vector => [p[0] * s, p[1] * s, p[2] * s];
const cross = (p: Vector, q: Vector): Vector => [
  p[1] * q[2] - p[2] * q[1],
  p[2] * q[0] - p[0] * q[2],
  p[0] * q[1] - p[1] * q[0],
];
const unit = (p: Vector): Vector => scale(p, 1 / Math.hypot(...p));

const ORIGIN: Vector = [0, 0, 0];

/** A number for each node from one for each triangle, weighted by the triangles' areas. */
function toNodes(surface: Surface, value: (corners: readonly number[]) => number): number[] {
  const sums = surface.vertices_mm.map(() => 0);
  const areas = surface.vertices_mm.map(() => 0);
  for (const triangle of surface.triangles) {
    const [p, q, r] = triangle.map((node) => surface.vertices_mm[node] ?? ORIGIN) as [
      Vector,
      Vector,
      Vector,
    ];
    const area = Math.hypot(...cross(sub(q, p), sub(r, p)));
    const here = area * value(triangle);
    for (const node of triangle) {
      sums[node] = (sums[node] ?? 0) + here;
      areas[node] = (areas[node] ?? 0) + area;
    }
  }
  return sums.map((sum, node) => sum / (areas[node] || 1));
}

/**
 * Largest principal strain of the surface, in magnitude: stretch minus one between a triangle at rest and deformed.
 *
 * With both edges of the rest triangle as columns D and of the deformed one as d, the stretches are the roots of the
 * eigenvalues of (DᵀD)⁻¹dᵀd.
 */
export function surfaceStrain(surface: Surface, rest: Surface): number[] {
  return toNodes(surface, (corners) => {
    const gram = ({ vertices_mm }: Surface): [number, number, number] => {
      const [p, q, r] = corners.map((node) => vertices_mm[node] ?? ORIGIN) as [
        Vector,
        Vector,
        Vector,
      ];
      const [e, f] = [sub(q, p), sub(r, p)];
      return [dot(e, e), dot(e, f), dot(f, f)];
    };
    const [a, b, c] = gram(rest);
    const [x, y, z] = gram(surface);
    const determinant = a * c - b * b;
    const half = (c * x - 2 * b * y + a * z) / determinant / 2;
    const root = Math.sqrt(Math.max(0, half * half - (x * z - y * y) / determinant));
    const strains = [half + root, half - root].map((square) => Math.sqrt(Math.max(0, square)) - 1);
    return Math.max(...strains.map(Math.abs));
  });
}

/**
 * Mean curvature, 1/mm, positive where the surface is hollow towards the vitreous.
 *
 * The second fundamental form of each triangle is fitted to how the nodes' normals turn along its edges (Rusinkiewicz
 * 2004), which needs no neighbours and so holds at the rim too.
 */
export function meanCurvature(surface: Surface): number[] {
  return toNodes(surface, (corners) => {
    const points = corners.map((node) => surface.vertices_mm[node] ?? ORIGIN) as [
      Vector,
      Vector,
      Vector,
    ];
    const normals = corners.map((node) => surface.normals[node] ?? ORIGIN) as [
      Vector,
      Vector,
      Vector,
    ];
    const u = unit(sub(points[1], points[0]));
    const v = cross(unit(cross(u, sub(points[2], points[0]))), u);
    // Normal equations of (L M; M N) edge = turn over the three edges.
    let [xx, xy, yy, xs, mixed, yt] = [0, 0, 0, 0, 0, 0];
    for (const [from, to] of [
      [0, 1],
      [1, 2],
      [2, 0],
    ] as const) {
      const edge = sub(points[to], points[from]);
      const turn = sub(normals[to], normals[from]);
      const [x, y, s, t] = [dot(edge, u), dot(edge, v), dot(turn, u), dot(turn, v)];
      xx += x * x;
      xy += x * y;
      yy += y * y;
      xs += x * s;
      mixed += y * s + x * t;
      yt += y * t;
    }
    // Eliminating M: L = (xs - xy M) / xx, N = (yt - xy M) / yy.
    const m =
      (mixed - (xy * xs) / xx - (xy * yt) / yy) / (xx + yy - (xy * xy) / xx - (xy * xy) / yy);
    return -((xs - xy * m) / xx + (yt - xy * m) / yy) / 2;
  });
}
