/** The needle's numbers, as far as the page must draw them. */

import type { NeedleShape } from "../scene/needle_geometry";
import type { Settings } from "./settings";
import type { GaugeList } from "./wire";

/** The server's documented defaults of a tip: a tenth of the radius, and 30 degrees. */
const EDGE_SHARE = 0.1;
export const BEVEL_ANGLE_DEG = 30;

/** A pressure under the needle that is well felt, mN/mm²: it sets how far a hand must move, not what is allowed. */
const FIRM_KPA = 16;

export function radiusMm({ gauge }: Settings, { gauges }: GaugeList): number {
  return (gauges.find(({ name }) => name === gauge)?.outer_diameter_mm ?? 0.5) / 2;
}

export function needleShape(settings: Settings, gauges: GaugeList): NeedleShape {
  const radius = radiusMm(settings, gauges);
  const edge = settings.parameters[`needle.tip.${settings.tip}.edge_radius_mm`];
  return {
    radiusMm: radius,
    tip: settings.tip,
    edgeRadiusMm: Math.min(radius, edge ?? EDGE_SHARE * radius),
    bevelAngleDeg: settings.parameters["needle.tip.bevelled.angle_deg"] ?? BEVEL_ANGLE_DEG,
  };
}

/** The force at the end of the slider, mN. */
export function firmForce(radius: number): number {
  return +(FIRM_KPA * Math.PI * radius * radius).toPrecision(1);
}
