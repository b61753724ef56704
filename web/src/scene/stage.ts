/** Everything that is seen in 3-D, and how an answer changes it. */

import { Color, type InstancedMesh } from "three";

import type { Scale } from "../colour/scale";
import type { Layer, Quantity } from "../model/settings";
import type { PredictRequest, PredictResponse, Surface } from "../model/wire";
import { ForceArrow, NormalArrows } from "./arrows";
import { EdgeLines } from "./edge_lines";
import type { NeedleShape } from "./needle_geometry";
import { NeedleMesh } from "./needle_mesh";
import { PatchMesh } from "./patch_mesh";
import { View } from "./view";

/** The rest surface is drawn this much too low, so that the tissue hides it wherever it has hardly moved. */
const SUNK_MM = 0.008;
const REST_COLOUR = 0x7a6cf0;

/** What depends on the nodes and triangles of a surface. */
interface Patch {
  topology: string;
  mesh: PatchMesh;
  normals: NormalArrows;
  /** Of the rest surface only the edges: a second sheet would hide the dent. */
  rest: EdgeLines;
  /** What it was last shaped to. */
  restShown: Surface | undefined;
  curved: boolean;
}

export class Stage {
  readonly view: View;
  readonly needle = new NeedleMesh();
  readonly force = new ForceArrow();
  private patch: Patch | undefined;
  private ink = new Color();

  constructor(canvas: HTMLCanvasElement, afterFrame: () => void) {
    this.view = new View(canvas, afterFrame);
    this.view.scene.add(this.needle.group, this.force.group);
    this.needle.group.visible = this.force.group.visible = false;
  }

  /** Light or dark: the colour of lines that stand before the page's background. */
  setInk(colour: Color): void {
    this.ink = colour;
    if (this.patch) this.dress(this.patch);
    this.view.requestFrame();
  }

  /** Shows an answer over its rest surface. */
  show(
    request: PredictRequest,
    answer: PredictResponse,
    rest: Surface,
    shape: NeedleShape,
    layers: Readonly<Record<Layer, boolean>>,
  ): void {
    const patch = this.patchFor(answer.surface);
    patch.mesh.shape(answer.surface, layers.curved);
    if (patch.restShown !== rest || patch.curved !== layers.curved) {
      patch.rest.shape(rest, layers.curved);
      Object.assign(patch, { restShown: rest, curved: layers.curved });
    }
    if (layers.normals) patch.normals.place(answer.surface);
    this.needle.shape(shape);
    this.needle.place(answer.needle.tip_mm, request.needle.orientation_xyzw ?? [0, 0, 0, 1]);
    this.force.place(answer.needle.tip_mm, request.force_mn ?? [0, 0, 0]);
    patch.mesh.edges.lines.visible = layers.triangles;
    patch.mesh.nodes.visible = layers.nodes;
    patch.normals.group.visible = layers.normals;
    patch.rest.lines.visible = layers.rest;
    this.needle.group.visible = layers.needle;
    this.force.group.visible &&= layers.needle;
    this.view.requestFrame();
  }

  paint(quantity: Quantity, values: readonly number[] | undefined, scale: Scale): void {
    this.patch?.mesh.paint(quantity, values, scale);
    this.view.requestFrame();
  }

  /** The point of the surface under a point of the window; `undefined` where there is none. */
  tissueAt(clientX: number, clientY: number): { x: number; y: number } | undefined {
    return this.patch && this.view.hit(clientX, clientY, [this.patch.mesh.surface]);
  }

  /** The nodes as they are drawn. */
  drawnNodes(): InstancedMesh | undefined {
    return this.patch?.mesh.nodes;
  }

  needleAt(clientX: number, clientY: number): boolean {
    const { group, front } = this.needle;
    return group.visible && this.view.hit(clientX, clientY, [front]) !== undefined;
  }

  private patchFor(surface: Surface): Patch {
    const topology = JSON.stringify([surface.vertices_mm.length, surface.triangles]);
    if (this.patch?.topology === topology) return this.patch;
    if (this.patch) {
      const { mesh, normals, rest } = this.patch;
      this.view.scene.remove(mesh.group, normals.group, rest.lines);
    }
    const mesh = new PatchMesh(surface);
    const normals = new NormalArrows(surface.vertices_mm.length);
    const rest = new EdgeLines(surface, 0.8);
    rest.lines.material.color = new Color(REST_COLOUR);
    rest.lines.position.z = -SUNK_MM;
    this.patch = { topology, mesh, normals, rest, restShown: undefined, curved: true };
    this.dress(this.patch);
    this.view.scene.add(mesh.group, normals.group, rest.lines);
    return this.patch;
  }

  private dress({ normals }: Patch): void {
    normals.colour(this.ink);
  }
}
