/** Error statistics over the nodes. */

import type { Vector } from "./wire";

export interface ErrorStatistics {
  meanUm: number;
  p99Um: number;
  maxUm: number;
}

/** Distance between corresponding nodes, µm. */
export function nodeErrors(answer: readonly Vector[], truth: readonly Vector[]): number[] {
  return answer.map((p, node) => {
    const q = truth[node] ?? p;
    return 1e3 * Math.hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
  });
}

/** Mean, nearest-rank 99th percentile and largest of the errors. */
export function statistics(errorsUm: readonly number[]): ErrorStatistics {
  const sorted = [...errorsUm].sort((a, b) => a - b);
  const at = (rank: number): number => sorted[Math.min(sorted.length, Math.max(1, rank)) - 1] ?? 0;
  return {
    meanUm: sorted.reduce((sum, error) => sum + error, 0) / Math.max(1, sorted.length),
    p99Um: at(Math.ceil(0.99 * sorted.length)),
    maxUm: at(sorted.length),
  };
}
