/** Computes the pose on screen at every level and holds each against `reference`. */

import * as api from "./model/api";
import type { Live } from "./live";
import { poseKey, type ComparisonRow, type Session, type Shown } from "./model/session";
import type { Settings } from "./model/settings";
import { nodeErrors, statistics } from "./model/statistics";
import type { Store } from "./model/store";
import type { PredictResponse } from "./model/wire";

const TRUTH = "reference";
/** How long the hand must rest before the error is computed by itself. */
const REST_MS = 500;

export class Compare {
  private running: { key: string; abort: AbortController } | undefined;
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly settings: Store<Settings>,
    private readonly session: Store<Session>,
    private readonly live: Live,
  ) {
    session.follow(({ shown }, before) => {
      if (shown !== before.shown) this.follow();
    });
    settings.follow(() => this.follow());
  }

  /** Gives up a pose that is no longer on screen; while the error is painted, starts anew when the hand rests. */
  private follow(): void {
    const { shown, comparison } = this.session.get();
    if (!shown) return;
    const key = poseKey(shown.request);
    if (this.running && this.running.key !== key) this.running.abort.abort();
    clearTimeout(this.timer);
    if (this.settings.get().quantity === "error" && comparison?.key !== key) {
      this.timer = setTimeout(() => void this.run(), REST_MS);
    }
  }

  async run(): Promise<void> {
    const { shown, catalog, connection } = this.session.get();
    if (!shown || !catalog || connection !== "connected" || !this.live.loop.idle) return;
    const running = { key: poseKey(shown.request), abort: new AbortController() };
    if (this.running?.key === running.key) return;
    this.running = running;
    this.session.patch({ comparing: true, comparisonProblem: undefined });
    const levels = catalog.levels.levels.map(({ name }) => name);
    const change = await this.allLevels(shown, levels, running.abort.signal);
    if (this.running !== running) return;
    this.running = undefined;
    const left = running.abort.signal.aborted ? {} : change;
    this.session.patch({ comparing: false, ...left });
  }

  private async allLevels(
    shown: Shown,
    levels: readonly string[],
    signal: AbortSignal,
  ): Promise<Partial<Session>> {
    const ask = (level: string): Promise<api.Reply> =>
      api.predict({ ...shown.request, accuracy: { level } }, signal);
    const truth = await ask(TRUTH);
    if (truth.kind === "problem") return { comparisonProblem: truth.problem };
    if (truth.kind !== "answer") return {};
    const rows: ComparisonRow[] = [];
    for (const level of levels) {
      const reply = level === TRUTH ? truth : await ask(level);
      if (reply.kind === "answer") rows.push(row(level, reply, truth.answer));
    }
    const moved = truth.answer.surface.displacement_um;
    const motionUm = Math.hypot(...moved) / Math.sqrt(moved.length);
    const key = poseKey(shown.request);
    return { comparison: { key, truth: truth.answer, rows, motionUm } };
  }
}

function row(
  level: string,
  reply: api.Reply & { kind: "answer" },
  truth: PredictResponse,
): ComparisonRow {
  const errors = statistics(
    nodeErrors(reply.answer.surface.vertices_mm, truth.surface.vertices_mm),
  );
  const { answer, roundTripMs } = reply;
  return { level, computeMs: answer.time_us.total / 1e3, roundTripMs, errors };
}

/** Error of each node on screen, µm; `undefined` where this pose was not compared. */
export function errorsOnScreen({ shown, comparison }: Session): number[] | undefined {
  if (!shown || !comparison || comparison.key !== poseKey(shown.request)) return undefined;
  return nodeErrors(shown.answer.surface.vertices_mm, comparison.truth.surface.vertices_mm);
}
