/** The few numbers over the view, the state of the connection, and what went wrong in plain words. */

import { figures } from "./colour/scale";
import type { Session } from "./model/session";
import type { Page } from "./page";
import { byId, element, setText } from "./panels/dom";
import { perFrame } from "./per_frame";

/** How often what changes is spoken to those who cannot see it. */
const SPOKEN_EVERY_MS = 1500;
/** A wait is worth a word when it is longer. */
const LONG_WAIT_MS = 250;

export function readout({ session, stage, settings, complaints }: Page): () => void {
  const deepest = element("strong");
  const cost = element("span", { class: "cost" });
  byId("readout").append(element("span", { class: "deepest" }, deepest, " deepest node"), cost);
  const [banner, connection, label] = [byId("banner"), byId("connection"), byId("force-label")];
  const times: number[] = [];

  session.follow((now, before) => {
    if (now.updates !== before.updates) times.push(performance.now());
    setText(
      connection,
      { connecting: "connecting …", connected: "connected", gone: "server gone" }[now.connection],
    );
    connection.className = now.connection;
    if (now.problem !== before.problem) complaints.tell(now.problem);
    tellWhatIsWrong(banner, now);
  });

  const depths = perFrame(() => setText(deepest, depth(session.get())));
  session.follow(({ shown }, before) => {
    if (shown !== before.shown) depths();
  });

  setInterval(() => {
    const { shown, waitingSince } = session.get();
    if (!shown) return;
    const since = performance.now() - 1000;
    while ((times[0] ?? Infinity) < since) times.shift();
    const wait = waitingSince === undefined ? 0 : performance.now() - waitingSince;
    const { accuracy, time_us } = shown.answer;
    const rate = times.length > 1 ? ` · ${times.length} updates/s` : "";
    const waiting = wait > LONG_WAIT_MS ? ` · computing for ${(wait / 1000).toFixed(1)} s` : rate;
    const ms = `${figures(time_us.total / 1e3)} ms, ${figures(shown.roundTripMs)} ms round trip`;
    setText(cost, `${accuracy.level}: ${ms}${waiting}`);
  }, 200);

  setInterval(() => {
    const now = session.get();
    const force = `${figures(settings.get().forceMn)} mN`;
    if (now.shown) setText(byId("spoken"), `${force}: deepest node ${depth(now)}`);
  }, SPOKEN_EVERY_MS);

  return () => {
    const { shown } = session.get();
    const visible = shown !== undefined && stage.force.group.visible;
    label.hidden = !visible;
    if (!visible) return;
    setText(label, `${figures(Math.hypot(...(shown.request.force_mn ?? [0])))} mN`);
    const { x, y } = stage.view.onCanvas(stage.force.tail);
    label.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
  };
}

function depth({ shown }: Session): string {
  return `${figures(Math.max(0, ...(shown?.answer.surface.displacement_um ?? [])))} µm`;
}

function tellWhatIsWrong(banner: HTMLElement, { connection, problem }: Session): void {
  const text =
    connection === "gone"
      ? "The server is gone. What you see is its last answer; the page comes back by itself."
      : problem && `Not shown: ${problem.title.toLowerCase()}. ${problem.detail}`;
  banner.hidden = text === undefined;
  setText(banner, text ?? "");
}
