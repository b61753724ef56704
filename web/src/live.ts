/** Keeps the answer on screen up with the settings, and the page up with the server. */

import * as api from "./model/api";
import { NewestWins } from "./model/newest";
import { prediction, rest, scene } from "./model/request";
import { restHeight } from "./model/rest_height";
import type { Session, Shown } from "./model/session";
import type { Settings } from "./model/settings";
import type { Store } from "./model/store";
import type { Surface } from "./model/wire";

/** An answer that takes longer is given up when there is a newer pose. */
const PATIENCE_MS = 400;
const RETRY_MS = 700;
const HEARTBEAT_MS = 2000;
/** Rest surfaces that are kept. */
const KEPT = 8;

type Outcome = { kind: "shown"; shown: Shown } | Exclude<api.Reply, { kind: "answer" }>;

export class Live {
  readonly loop = new NewestWins<Settings, Outcome>(
    (settings, signal) => this.ask(settings, signal),
    (outcome) => this.take(outcome),
    PATIENCE_MS,
  );
  private readonly rests = new Map<string, Surface>();
  private reconnecting = false;

  constructor(
    private readonly settings: Store<Settings>,
    private readonly session: Store<Session>,
  ) {}

  start(): void {
    void this.connect();
    setInterval(() => void this.heartbeat(), HEARTBEAT_MS);
  }

  /** Asks for what the settings now say. */
  refresh(): void {
    if (this.session.get().connection === "connected") this.loop.offer(this.settings.get());
  }

  private async ask(settings: Settings, signal: AbortSignal): Promise<Outcome> {
    const { catalog, waitingSince } = this.session.get();
    if (!catalog) return { kind: "gone" };
    if (waitingSince === undefined) this.session.patch({ waitingSince: performance.now() });
    const surface = await this.restOf(settings, catalog, signal);
    if ("kind" in surface) return surface;
    const height = restHeight(surface, settings.xMm, settings.yMm);
    const request = prediction(settings, catalog.scenes, height);
    const reply = await api.predict(request, signal);
    if (reply.kind !== "answer") return reply;
    const { answer, roundTripMs } = reply;
    return { kind: "shown", shown: { settings, request, answer, rest: surface, roundTripMs } };
  }

  private async restOf(
    settings: Settings,
    catalog: api.Catalog,
    signal: AbortSignal,
  ): Promise<Surface | Exclude<api.Reply, { kind: "answer" }>> {
    const what = scene(settings, catalog.scenes);
    const key = JSON.stringify(what);
    const known = this.rests.get(key);
    if (known) return known;
    const reply = await api.predict(rest(what), signal);
    if (reply.kind !== "answer") return reply;
    const oldest = this.rests.keys().next();
    if (this.rests.size >= KEPT && !oldest.done) this.rests.delete(oldest.value);
    this.rests.set(key, reply.answer.surface);
    return reply.answer.surface;
  }

  private take(outcome: Outcome): void {
    const waitingSince = this.loop.idle ? undefined : performance.now();
    switch (outcome.kind) {
      case "shown": {
        const updates = this.session.get().updates + 1;
        this.session.patch({ shown: outcome.shown, problem: undefined, waitingSince, updates });
        break;
      }
      case "problem":
        this.session.patch({ problem: outcome.problem, waitingSince });
        if (outcome.problem.status === 503) setTimeout(() => this.refresh(), 1000);
        break;
      case "gone":
        this.lost();
        break;
      case "aborted":
        break;
    }
  }

  private lost(): void {
    this.session.patch({ connection: "gone", waitingSince: undefined });
    if (this.reconnecting) return;
    this.reconnecting = true;
    setTimeout(() => void this.connect(), RETRY_MS);
  }

  private async connect(): Promise<void> {
    try {
      const catalog = await api.catalog();
      this.reconnecting = false;
      this.session.patch({ catalog, connection: "connected" });
      this.refresh();
    } catch {
      this.reconnecting = false;
      this.lost();
    }
  }

  private async heartbeat(): Promise<void> {
    const { connection } = this.session.get();
    if (connection !== "connected" || !this.loop.idle) return;
    if (!(await api.alive())) this.lost();
  }
}
