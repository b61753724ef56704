/** What the page knows from the server, and how it stands with it. */

import type { Catalog } from "./api";
import type { ErrorStatistics } from "./statistics";
import type { Settings } from "./settings";
import type { PredictRequest, PredictResponse, Problem, Surface } from "./wire";

/** An answer with what it was an answer to. */
export interface Shown {
  settings: Settings;
  request: PredictRequest;
  answer: PredictResponse;
  rest: Surface;
  roundTripMs: number;
}

export interface ComparisonRow {
  level: string;
  computeMs: number;
  roundTripMs: number;
  errors: ErrorStatistics;
}

/** A pose at every level. */
export interface Comparison {
  /** [`poseKey`] of the pose. */
  key: string;
  truth: PredictResponse;
  rows: ComparisonRow[];
  /** RMS length of the nodes' displacements at `reference`, µm: what the errors are small or large against. */
  motionUm: number;
}

export interface Session {
  connection: "connecting" | "connected" | "gone";
  catalog: Catalog | undefined;
  shown: Shown | undefined;
  /** Why the newest pose has no answer. */
  problem: Problem | undefined;
  /** When the question that is on its way was asked, as of `performance.now()`. */
  waitingSince: number | undefined;
  comparing: boolean;
  comparison: Comparison | undefined;
  comparisonProblem: Problem | undefined;
  /** Answers taken so far. */
  updates: number;
}

export const NOTHING_YET: Session = {
  connection: "connecting",
  catalog: undefined,
  shown: undefined,
  problem: undefined,
  waitingSince: undefined,
  comparing: false,
  comparison: undefined,
  comparisonProblem: undefined,
  updates: 0,
};

/** Tells poses apart, whatever the accuracy asked for. */
export function poseKey({ accuracy: _, ...pose }: PredictRequest): string {
  return JSON.stringify(pose);
}
