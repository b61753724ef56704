/**
 * A curved triangle through three nodes with the server's normals there (Vlachos 2001): what is drawn between the nodes.
 *
 * A flat triangle between nodes 0.3 mm apart would cut through a needle of half that radius. The nodes themselves are where the
 * server put them.
 */

import type { Triangle, Vector } from "../model/wire";

/** Pieces along each edge. */
export const PIECES = 6;

type Weights = readonly [number, number, number];

/** Barycentric coordinates of the points of one triangle, row by row. */
export const POINTS: readonly Weights[] = Array.from({ length: PIECES + 1 }, (_, row) =>
  Array.from({ length: PIECES - row + 1 }, (_, column): Weights => {
    const [v, w] = [column / PIECES, row / PIECES];
    return [1 - v - w, v, w];
  }),
).flat();

/** Small triangles between those points. */
export const FACES: readonly [number, number, number][] = Array.from(
  { length: PIECES },
  (_, row) => {
    const start = (r: number): number => r * (PIECES + 1) - (r * (r - 1)) / 2;
    return Array.from({ length: PIECES - row }, (_, column) => {
      const [here, above] = [start(row) + column, start(row + 1) + column];
      const up: [number, number, number] = [here, here + 1, above];
      const down: [number, number, number] = [here + 1, above + 1, above];
      return column < PIECES - row - 1 ? [up, down] : [up];
    }).flat();
  },
).flat();

/** What each control point counts for at a place in the triangle. */
export function bernstein([u, v, w]: Weights): readonly number[] {
  return [
    u * u * u,
    v * v * v,
    w * w * w,
    3 * u * u * v,
    3 * u * v * v,
    3 * v * v * w,
    3 * v * w * w,
    3 * w * w * u,
    3 * w * u * u,
    6 * u * v * w,
  ];
}

export type Corners = readonly [Vector, Vector, Vector];

const ORIGIN: Vector = [0, 0, 0];

/** What a list of nodes or normals has at the corners of a triangle. */
export function corners(list: readonly Vector[], [i, j, k]: Triangle): Corners {
  return [list[i] ?? ORIGIN, list[j] ?? ORIGIN, list[k] ?? ORIGIN];
}

/** A third of the way from `p` to `q`, moved into the plane across the normal at `p`. */
function pulled(p: Vector, q: Vector, normal: Vector, curved: boolean): Vector {
  const d: Vector = [q[0] - p[0], q[1] - p[1], q[2] - p[2]];
  const out = curved ? d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2] : 0;
  return [
    p[0] + (d[0] - out * normal[0]) / 3,
    p[1] + (d[1] - out * normal[1]) / 3,
    p[2] + (d[2] - out * normal[2]) / 3,
  ];
}

/** Control points of a cubic triangle: corners, two for each edge, the middle. */
export class CurvedTriangle {
  private readonly points: readonly Vector[];

  constructor(p: Corners, n: Corners, curved: boolean) {
    const edge = (i: 0 | 1 | 2, j: 0 | 1 | 2): Vector => pulled(p[i], p[j], n[i], curved);
    const edges = [edge(0, 1), edge(1, 0), edge(1, 2), edge(2, 1), edge(2, 0), edge(0, 2)];
    const middle = [0, 1, 2].map((axis) => {
      const mean = (list: readonly Vector[]): number =>
        list.reduce((sum, point) => sum + (point[axis] ?? 0), 0) / list.length;
      return 1.5 * mean(edges) - 0.5 * mean(p);
    }) as Vector;
    this.points = [...p, ...edges, middle];
  }

  /** Writes the point with these [`bernstein`] weights to `out` from `offset`. */
  at(weights: readonly number[], out: Float32Array, offset: number): void {
    for (let axis = 0; axis < 3; axis++) {
      let sum = 0;
      for (let k = 0; k < 10; k++) sum += (weights[k] ?? 0) * (this.points[k]?.[axis] ?? 0);
      out[offset + axis] = sum;
    }
  }
}
