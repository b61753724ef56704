/** What crosses the wire: the parts of the server's `/openapi.json` that the page uses. Units are in the names. */

export type Vector = [number, number, number];
export type Quaternion = [number, number, number, number];
export type Triangle = [number, number, number];
export type TipName = "hemispherical" | "flat" | "bevelled";
export type Accuracy = { level: string } | { max_error_um: number } | { max_time_ms: number };
export type Effects = "auto" | "all" | string[];

export type TipSpec =
  | "hemispherical"
  | { flat: { edge_radius_mm?: number } }
  | { bevelled: { angle_deg?: number; edge_radius_mm?: number } };

/** A scene written out; its fields are known to the page only by the paths that the server lists. */
export interface SceneSpec {
  [field: string]: unknown;
}

export interface PredictRequest {
  scene: string | SceneSpec;
  needle: { tip_mm: Vector; orientation_xyzw?: Quaternion; gauge?: string; tip?: TipSpec };
  force_mn?: Vector;
  control?: "pose";
  accuracy: Accuracy;
  effects?: Effects;
}

export interface Surface {
  vertices_mm: Vector[];
  normals: Vector[];
  triangles: Triangle[];
  displacement_um: number[];
}

export interface EffectAnswer {
  name: string;
  simulated: boolean;
  reason: string;
  value?: number;
  threshold?: number;
}

export interface PredictResponse {
  surface: Surface;
  needle: { tip_mm: Vector; travel_mm: number; reaction_mn: Vector };
  contact: {
    state: string;
    area_mm2: number;
    max_strain: number;
    max_pressure_kpa: number;
    /** Fluid under the retina, where it is simulated. */
    bleb?: { pressure_kpa: number; pressure_mmhg: number; volume_mm3: number };
  };
  accuracy: {
    level: string;
    expected_error_um?: { median?: number; p95?: number };
    calibrated?: boolean;
  };
  effects: EffectAnswer[];
  time_us: { total: number; stages: Record<string, number> };
  warnings: string[];
}

export interface Parameter {
  field: string;
  name: string;
  unit: string;
  default: number;
  min: number;
  max: number;
  source: string;
}

export interface SceneList {
  default: string;
  scenes: { name: string; scene: SceneSpec }[];
  patch: { nodes_per_side: number; spacing_mm: number; size_mm: number };
  parameters: Parameter[];
}

export interface LevelList {
  default: string;
  levels: { name: string; what: string; cost: string }[];
}

export interface GaugeList {
  default: string;
  gauges: { name: string; outer_diameter_mm: number; source: string }[];
}

/** A level or a setting, measured: the error of a request's worst node and the time of an answer. */
export interface CostStanding {
  name: string;
  knob: string;
  failed: number;
  median_um: number;
  p99_um: number;
  median_ms: number;
  p99_ms: number;
}

/** Requests of one kind. */
export interface CostPanel {
  panel: string;
  caption: string;
  requests: number;
  floor_um: number;
  reference: CostStanding;
  standings: CostStanding[];
}

/** What accuracy costs in time. */
export interface CostTable {
  circumstances: { processor: string; version: string };
  panels: CostPanel[];
}

/** An RFC 9457 problem document. */
export interface Problem {
  type: string;
  title: string;
  status: number;
  detail: string;
  errors?: { field: string; value?: unknown; allowed: string }[];
}
