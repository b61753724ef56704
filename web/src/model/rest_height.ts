/** The height of the rest surface over a point of the patch. */

import type { Surface } from "./wire";

/** Interpolated in the triangle over (x, y), mm; that of the nearest node outside of the patch. */
export function restHeight({ vertices_mm, triangles }: Surface, x: number, y: number): number {
  for (const [i, j, k] of triangles) {
    const [p, q, r] = [vertices_mm[i], vertices_mm[j], vertices_mm[k]];
    if (!p || !q || !r) continue;
    const area = (q[0] - p[0]) * (r[1] - p[1]) - (r[0] - p[0]) * (q[1] - p[1]);
    const b = ((x - p[0]) * (r[1] - p[1]) - (r[0] - p[0]) * (y - p[1])) / area;
    const c = ((q[0] - p[0]) * (y - p[1]) - (x - p[0]) * (q[1] - p[1])) / area;
    if (b >= 0 && c >= 0 && b + c <= 1) return p[2] + b * (q[2] - p[2]) + c * (r[2] - p[2]);
  }
  const distance = (node: readonly number[]): number =>
    Math.hypot((node[0] ?? 0) - x, (node[1] ?? 0) - y);
  const nearest = vertices_mm.reduce((best, node) =>
    distance(node) < distance(best) ? node : best,
  );
  return nearest[2];
}
