/** The only file that talks to the server. */

import type {
  CostTable,
  GaugeList,
  LevelList,
  PredictRequest,
  PredictResponse,
  Problem,
  SceneList,
} from "./wire";

export type Reply =
  | { kind: "answer"; answer: PredictResponse; roundTripMs: number }
  | { kind: "problem"; problem: Problem }
  | { kind: "gone" }
  | { kind: "aborted" };

export interface Catalog {
  scenes: SceneList;
  levels: LevelList;
  gauges: GaugeList;
  /** What accuracy costs in time; a server without measurements has none. */
  costs: CostTable | undefined;
  /** Fields of `accuracy` that the server describes. */
  accuracyFields: string[];
}

/** The slice of `/openapi.json` that tells which promises the server can be asked for. */
interface Description {
  components: { schemas: { AccuracySpec?: { properties?: Record<string, unknown> } } };
}

/** Posts a prediction; never throws. */
export async function predict(request: PredictRequest, signal: AbortSignal): Promise<Reply> {
  const started = performance.now();
  try {
    const response = await fetch("/v1/predict", {
      method: "POST",
      headers: { "content-type": "application/json" },
      body: JSON.stringify(request),
      signal,
    });
    const body: unknown = await response.json();
    if (!response.ok) return { kind: "problem", problem: body as Problem };
    const roundTripMs = performance.now() - started;
    return { kind: "answer", answer: body as PredictResponse, roundTripMs };
  } catch {
    return signal.aborted ? { kind: "aborted" } : { kind: "gone" };
  }
}

/** Everything there is to choose from; throws when the server is gone. */
export async function catalog(): Promise<Catalog> {
  const [scenes, levels, gauges, costs, description] = await Promise.all([
    get<SceneList>("/v1/scenes"),
    get<LevelList>("/v1/levels"),
    get<GaugeList>("/v1/gauges"),
    get<CostTable>("/v1/accuracy").catch(() => undefined),
    get<Description>("/openapi.json"),
  ]);
  const properties = description.components.schemas.AccuracySpec?.properties ?? {};
  return { scenes, levels, gauges, costs, accuracyFields: Object.keys(properties) };
}

/** Whether the server is there. */
export async function alive(): Promise<boolean> {
  try {
    await get("/healthz");
    return true;
  } catch {
    return false;
  }
}

async function get<T>(path: string): Promise<T> {
  const response = await fetch(path, { cache: "no-store" });
  if (!response.ok) throw new Error(`${path}: ${response.status}`);
  return (await response.json()) as T;
}
