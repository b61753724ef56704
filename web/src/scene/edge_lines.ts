/** The edges of the triangles, bent like the surface between the nodes. */

import { BufferAttribute, BufferGeometry, LineBasicMaterial, LineSegments } from "three";

import type { Surface, Triangle } from "../model/wire";
import { bernstein, corners, CurvedTriangle, PIECES } from "./pn_triangle";

/** At the ends of the pieces of an edge. */
const WEIGHTS = Array.from({ length: PIECES + 1 }, (_, piece) =>
  bernstein([1 - piece / PIECES, piece / PIECES, 0]),
);

/** Each edge once, by its two nodes. */
function edgesOf(triangles: readonly Triangle[]): [number, number][] {
  const edges = new Map<string, [number, number]>();
  for (const [i, j, k] of triangles) {
    for (const [a, b] of [
      [i, j],
      [j, k],
      [k, i],
    ] as const) {
      edges.set(a < b ? `${a} ${b}` : `${b} ${a}`, [a, b]);
    }
  }
  return [...edges.values()];
}

export class EdgeLines {
  readonly lines: LineSegments<BufferGeometry, LineBasicMaterial>;
  private readonly edges: [number, number][];

  /** For surfaces with the triangles of `like`. */
  constructor(like: Surface, opacity: number) {
    this.edges = edgesOf(like.triangles);
    const geometry = new BufferGeometry();
    const room = new Float32Array(this.edges.length * PIECES * 6);
    geometry.setAttribute("position", new BufferAttribute(room, 3));
    const material = new LineBasicMaterial({ color: 0x17242c, transparent: true, opacity });
    this.lines = new LineSegments(geometry, material);
    this.lines.frustumCulled = false;
  }

  shape(surface: Surface, curved: boolean): void {
    const position = this.lines.geometry.getAttribute("position") as BufferAttribute;
    const out = position.array as Float32Array;
    this.edges.forEach(([a, b], e) => {
      const between: Triangle = [a, b, b];
      const points = corners(surface.vertices_mm, between);
      const edge = new CurvedTriangle(points, corners(surface.normals, between), curved);
      for (let piece = 0; piece < PIECES; piece++) {
        for (const end of [0, 1]) {
          edge.at(WEIGHTS[piece + end] ?? [], out, 6 * (e * PIECES + piece) + 3 * end);
        }
      }
    });
    position.needsUpdate = true;
  }
}
