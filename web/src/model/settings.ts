/** What the person at the page wants: the pose, the choices, the view. One flat record, so that it fits in a URL. */

import type { Accuracy, Effects, TipName } from "./wire";

export type Quantity = "displacement" | "curvature" | "strain" | "error";
export type Layer = "triangles" | "nodes" | "normals" | "rest" | "needle" | "curved";

export interface Settings {
  scene: string;
  /** Numbers that differ from the scene's own, by the field that the server lists. */
  parameters: Readonly<Record<string, number>>;
  gauge: string;
  tip: TipName;
  /** Where the tip stands over the patch, mm. */
  xMm: number;
  yMm: number;
  forceMn: number;
  /** The shaft's lean from +z, the side to which it leans (from +x to +y) and the turn about itself. */
  tiltDeg: number;
  leanDeg: number;
  rollDeg: number;
  /** The way the force acts: along the shaft, or along −z whatever the tilt. */
  along: "needle" | "inward";
  accuracy: Accuracy;
  effects: Effects;
  quantity: Quantity;
  layers: Readonly<Record<Layer, boolean>>;
}

export const QUANTITIES: readonly Quantity[] = ["displacement", "curvature", "strain", "error"];
export const LAYERS: readonly Layer[] = [
  "triangles",
  "nodes",
  "normals",
  "rest",
  "needle",
  "curved",
];
export const TIPS: readonly TipName[] = ["hemispherical", "flat", "bevelled"];

/** A dent that is seen at once. */
export const INITIAL: Settings = {
  scene: "macula",
  parameters: {},
  gauge: "25G",
  tip: "hemispherical",
  xMm: 0.12,
  yMm: -0.05,
  forceMn: 0.8,
  tiltDeg: 15,
  leanDeg: 90,
  rollDeg: 0,
  along: "needle",
  accuracy: { level: "linear" },
  effects: "auto",
  quantity: "displacement",
  layers: {
    triangles: true,
    nodes: true,
    normals: false,
    rest: true,
    needle: true,
    curved: true,
  },
};
