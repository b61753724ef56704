/**
 * The needle's true surface, in its own frame: foremost point at the origin, shaft along +z, sharp point of a bevel towards +x.
 *
 * The same solid as the server's: a rounded edge of radius r around a core that is a cylinder of radius c, cut by a plane. Every
 * tip is this one formula: the core is the axis alone for half a ball, the plane stands across the shaft for a flat tip and
 * leans for a bevel. With a the distance outside of the cylinder and b that beyond the plane, the surface is b = r under the core,
 * a² + b² = r² around its edge and a = r along the shaft.
 */

import { BufferAttribute, BufferGeometry } from "three";

import type { TipName } from "../model/wire";

export interface NeedleShape {
  radiusMm: number;
  tip: TipName;
  edgeRadiusMm: number;
  bevelAngleDeg: number;
}

const AROUND = 48;
const UNDER = 8;
const EDGE = 10;

/** A ring of the surface: distance from the axis, distance beyond the plane. */
interface Ring {
  out: number;
  beyond: number;
}

export function needleGeometry(shape: NeedleShape, lengthMm: number): BufferGeometry {
  const edge = shape.tip === "hemispherical" ? shape.radiusMm : shape.edgeRadiusMm;
  const core = shape.radiusMm - edge;
  const bevel = shape.tip === "bevelled" ? (shape.bevelAngleDeg * Math.PI) / 180 : Math.PI / 2;
  const [sin, cos] = [Math.sin(bevel), shape.tip === "bevelled" ? Math.cos(bevel) : 0];
  // The lowest point of the rounded edge over the sharp corner is the origin when the core's corner stands here.
  const length = Math.hypot(1, cos);
  const corner = { x: cos === 0 ? core : (-edge * cos) / length, z: (edge * length) / sin };
  const axisX = corner.x - core;
  const rings: Ring[] = [
    ...Array.from({ length: UNDER }, (_, k) => ({ out: (core * k) / UNDER, beyond: edge })),
    ...Array.from({ length: EDGE + 1 }, (_, k) => {
      const angle = ((k / EDGE) * Math.PI) / 2;
      return { out: core + edge * Math.sin(angle), beyond: edge * Math.cos(angle) };
    }),
  ];
  const columns = AROUND + 1;
  const rows = rings.length + 1;
  const position = new BufferAttribute(new Float32Array(3 * columns * rows), 3);
  const normal = new BufferAttribute(new Float32Array(3 * columns * rows), 3);
  for (let column = 0; column < columns; column++) {
    const azimuth = (2 * Math.PI * column) / AROUND;
    const [dx, dy] = [Math.cos(azimuth), Math.sin(azimuth)];
    const put = (row: number, out: number, z: number, a: number, b: number): void => {
      const index = row * columns + column;
      position.setXYZ(index, axisX + out * dx, out * dy, z);
      const n = [a * dx - b * cos, a * dy, -b * sin] as const;
      const size = Math.hypot(...n);
      normal.setXYZ(index, n[0] / size, n[1] / size, n[2] / size);
    };
    rings.forEach(({ out, beyond }, row) => {
      const x = axisX + out * dx;
      const z = corner.z - (beyond + cos * (x - corner.x)) / sin;
      put(row, out, z, Math.max(0, out - core), beyond);
    });
    put(rings.length, shape.radiusMm, lengthMm, 1, 0);
  }
  const index: number[] = [];
  for (let row = 0; row + 1 < rows; row++) {
    for (let column = 0; column < AROUND; column++) {
      const [a, b] = [row * columns + column, (row + 1) * columns + column];
      index.push(a, b, a + 1, b, b + 1, a + 1);
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", position);
  geometry.setAttribute("normal", normal);
  geometry.setIndex(index);
  return geometry;
}
