/** The surface: curved triangles, painted with one number for each node, with its edges and nodes. */

import {
  BufferAttribute,
  BufferGeometry,
  Color,
  DoubleSide,
  Group,
  InstancedMesh,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  MeshPhongMaterial,
  SphereGeometry,
} from "three";

import type { Scale } from "../colour/scale";
import type { Quantity } from "../model/settings";
import type { Surface, Triangle } from "../model/wire";
import { colourMap } from "./colour_map";
import { EdgeLines } from "./edge_lines";
import { bernstein, corners, CurvedTriangle, FACES, POINTS } from "./pn_triangle";

const POINT_WEIGHTS = POINTS.map(bernstein);
const NODE_RADIUS_MM = 0.0095;
export class PatchMesh {
  readonly group = new Group();
  readonly surface: Mesh<BufferGeometry, MeshPhongMaterial>;
  readonly edges: EdgeLines;
  readonly nodes: InstancedMesh<SphereGeometry, MeshBasicMaterial>;
  private readonly triangles: readonly Triangle[];

  /** For surfaces with the nodes and triangles of `like`. */
  constructor(like: Surface) {
    this.triangles = like.triangles;
    const count = like.triangles.length * POINTS.length;
    const geometry = new BufferGeometry();
    for (const [name, size] of [
      ["position", 3],
      ["normal", 3],
      ["uv", 2],
    ] as const) {
      geometry.setAttribute(name, new BufferAttribute(new Float32Array(count * size), size));
    }
    geometry.setIndex(
      like.triangles.flatMap((_, t) =>
        FACES.flatMap((face) => face.map((p) => t * POINTS.length + p)),
      ),
    );
    const material = new MeshPhongMaterial({ side: DoubleSide });
    // The edges lie in the surface and must win against it.
    Object.assign(material, { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 2 });
    this.surface = new Mesh(geometry, material);
    this.edges = new EdgeLines(like, 0.32);
    const ball = new SphereGeometry(NODE_RADIUS_MM, 8, 6);
    this.nodes = new InstancedMesh(
      ball,
      new MeshBasicMaterial({ color: 0x17242c }),
      like.vertices_mm.length,
    );
    for (const part of [this.surface, this.edges.lines, this.nodes]) {
      part.frustumCulled = false;
      this.group.add(part);
    }
  }

  /** Moves everything to a surface. */
  shape(surface: Surface, curved: boolean): void {
    const position = this.surface.geometry.getAttribute("position") as BufferAttribute;
    const normal = this.surface.geometry.getAttribute("normal") as BufferAttribute;
    const [points, normals] = [position.array as Float32Array, normal.array as Float32Array];
    this.triangles.forEach((triangle, t) => {
      const n = corners(surface.normals, triangle);
      const shape = new CurvedTriangle(corners(surface.vertices_mm, triangle), n, curved);
      POINTS.forEach((weights, p) => {
        const offset = 3 * (t * POINTS.length + p);
        shape.at(POINT_WEIGHTS[p] ?? [], points, offset);
        const [u, v, w] = weights;
        for (let axis = 0; axis < 3; axis++) {
          normals[offset + axis] =
            u * (n[0][axis] ?? 0) + v * (n[1][axis] ?? 0) + w * (n[2][axis] ?? 0);
        }
      });
    });
    position.needsUpdate = normal.needsUpdate = true;
    this.surface.geometry.computeBoundingSphere();
    this.edges.shape(surface, curved);
    const place = new Matrix4();
    surface.vertices_mm.forEach((node, index) => {
      this.nodes.setMatrixAt(index, place.makeTranslation(...node));
    });
    this.nodes.instanceMatrix.needsUpdate = true;
  }

  /** Paints a number for each node; plain tissue without. */
  paint(quantity: Quantity, values: readonly number[] | undefined, scale: Scale): void {
    const { material, geometry } = this.surface;
    const map = values ? colourMap(quantity) : null;
    if (material.map !== map) {
      material.needsUpdate = (material.map === null) !== (map === null);
      material.map = map;
      material.color = new Color(map ? 0xffffff : 0xc98d86);
    }
    if (!values) return;
    const uv = geometry.getAttribute("uv") as BufferAttribute;
    const place = (node: number): number =>
      ((values[node] ?? 0) - scale.min) / (scale.max - scale.min);
    this.triangles.forEach(([i, j, k], t) => {
      const [a, b, c] = [place(i), place(j), place(k)];
      POINTS.forEach(([u, v, w], p) => uv.setXY(t * POINTS.length + p, u * a + v * b + w * c, 0.5));
    });
    uv.needsUpdate = true;
  }
}
