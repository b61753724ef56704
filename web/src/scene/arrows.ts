/** Arrows: one for the force, many for the normals. */

import {
  BufferAttribute,
  BufferGeometry,
  Color,
  ConeGeometry,
  CylinderGeometry,
  Group,
  InstancedMesh,
  LineBasicMaterial,
  LineSegments,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  Quaternion,
  Vector3,
} from "three";

import type { Surface, Vector } from "../model/wire";

const FORCE_COLOUR = 0xff6a3d;
const NORMAL_LENGTH_MM = 0.17;
const HEAD_MM = 0.05;
const FORCE_HEAD_MM = 0.13;
const UP = new Vector3(0, 1, 0);

/** How long the arrow of a force is drawn, mm: 1 mm for 1 mN, kept within what fits the view. */
function forceLength(forceMn: number): number {
  return Math.min(1.5, Math.max(0.3, forceMn));
}

/** The force on the tissue: its head is at the tip. Seen through needle and tissue. */
export class ForceArrow {
  readonly group = new Group();
  /** Where the arrow begins: the place of its label. */
  readonly tail = new Vector3();
  private readonly shaft: Mesh;

  constructor() {
    const material = new MeshBasicMaterial({
      color: FORCE_COLOUR,
      depthTest: false,
      transparent: true,
    });
    // Both begin at the head's point and run along -y.
    const shaft = new CylinderGeometry(0.013, 0.013, 1, 12).translate(0, -0.5, 0);
    const head = new ConeGeometry(0.045, FORCE_HEAD_MM, 20).translate(0, -FORCE_HEAD_MM / 2, 0);
    this.shaft = new Mesh(shaft, material);
    this.shaft.position.y = -FORCE_HEAD_MM;
    const parts = [this.shaft, new Mesh(head, material)];
    for (const part of parts) part.renderOrder = 5;
    this.group.add(...parts);
  }

  place(tipMm: Vector, forceMn: Vector): void {
    const force = new Vector3(...forceMn);
    const size = force.length();
    this.group.visible = size > 0;
    if (size === 0) return;
    const length = forceLength(size);
    const direction = force.divideScalar(size);
    this.group.position.set(...tipMm);
    this.group.quaternion.setFromUnitVectors(UP, direction);
    this.shaft.scale.y = length - FORCE_HEAD_MM;
    this.tail.set(...tipMm).addScaledVector(direction, -length);
  }
}

/** The unit normals at the nodes, all drawn with one length. */
export class NormalArrows {
  readonly group = new Group();
  private readonly lines: LineSegments<BufferGeometry, LineBasicMaterial>;
  private readonly heads: InstancedMesh<ConeGeometry, MeshBasicMaterial>;

  constructor(count: number) {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(new Float32Array(6 * count), 3));
    this.lines = new LineSegments(geometry, new LineBasicMaterial());
    const cone = new ConeGeometry(0.014, HEAD_MM, 8).translate(0, -HEAD_MM / 2, 0);
    this.heads = new InstancedMesh(cone, new MeshBasicMaterial(), count);
    this.lines.frustumCulled = this.heads.frustumCulled = false;
    this.group.add(this.lines, this.heads);
  }

  colour(colour: Color): void {
    this.lines.material.color = this.heads.material.color = colour;
  }

  place({ vertices_mm, normals }: Surface): void {
    const position = this.lines.geometry.getAttribute("position") as BufferAttribute;
    const [turn, matrix, size] = [new Quaternion(), new Matrix4(), new Vector3(1, 1, 1)];
    vertices_mm.forEach((node, index) => {
      const normal = new Vector3(...(normals[index] ?? [0, 0, 1]));
      const from = new Vector3(...node);
      const end = from.clone().addScaledVector(normal, NORMAL_LENGTH_MM);
      position.setXYZ(2 * index, from.x, from.y, from.z);
      position.setXYZ(2 * index + 1, end.x, end.y, end.z);
      this.heads.setMatrixAt(index, matrix.compose(end, turn.setFromUnitVectors(UP, normal), size));
    });
    position.needsUpdate = this.heads.instanceMatrix.needsUpdate = true;
  }
}
