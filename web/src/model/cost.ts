/** What accuracy costs in time, as the server's measurements tell: which of them fit a pose, and where they stand on a chart. */

import type { Settings } from "./settings";
import type { CostPanel, CostStanding, CostTable } from "./wire";

/** A logarithmic axis from the data's numbers to places on the chart. */
export interface Axis {
  readonly from: number;
  readonly to: number;
  /** Where the axis begins and ends on the chart. */
  readonly start: number;
  readonly end: number;
}

/** The place of a value; what lies beyond the axis stands at its end. */
export function place({ from, to, start, end }: Axis, value: number): number {
  const share = Math.log(value / from) / Math.log(to / from);
  return start + (end - start) * Math.min(1, Math.max(0, share));
}

/** The value at a place. */
export function valueAt({ from, to, start, end }: Axis, at: number): number {
  return from * (to / from) ** ((at - start) / (end - start));
}

/** The powers of ten on an axis. */
export function decades({ from, to }: Axis): number[] {
  const first = Math.ceil(Math.log10(from) - 1e-9);
  const last = Math.floor(Math.log10(to) + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, step) => 10 ** (first + step));
}

/** The requests that were measured and are most like the pose: sharp tips, tissue of one's own, or neither. */
export function panelFor(table: CostTable, settings: Settings): CostPanel | undefined {
  const { tip, parameters } = settings;
  const name =
    tip !== "hemispherical" ? "hard" : Object.keys(parameters).length > 0 ? "outside" : "default";
  return table.panels.find(({ panel }) => panel === name);
}

/** Levels and settings that no other beats in both error and time (medians), cheapest first. */
export function frontier(standings: readonly CostStanding[]): CostStanding[] {
  const answering = standings.filter(({ median_ms }) => median_ms > 0);
  const ordered = [...answering].sort((a, b) => a.median_ms - b.median_ms);
  let best = Infinity;
  return ordered.filter(({ median_um }) => {
    const better = median_um < best;
    if (better) best = median_um;
    return better;
  });
}
