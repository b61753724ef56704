/** Puts the page together: settings ask, answers are shown, the URL follows. */

import { Color } from "three";

import "./style/page.css";
import "./style/controls.css";
import "./style/chart.css";
import { Compare } from "./compare";
import { inspect } from "./inspect";
import { keyboard } from "./keyboard";
import { Live } from "./live";
import { NOTHING_YET, type Session } from "./model/session";
import type { Settings } from "./model/settings";
import { Store } from "./model/store";
import { fromHash, toHash } from "./model/url";
import type { Page } from "./page";
import { Paint } from "./paint";
import { accuracyPanel } from "./panels/accuracy";
import { colourPanel } from "./panels/colour";
import { Complaints } from "./panels/complaints";
import { byId } from "./panels/dom";
import { effectsPanel } from "./panels/effects";
import { keepPanel } from "./panels/keep";
import { pressPanel } from "./panels/press";
import { tissuePanel } from "./panels/tissue";
import { pointer } from "./pointer";
import { readout } from "./readout";
import { Stage } from "./scene/stage";

/** How long the hand must rest before the URL is written: browsers limit how often it may be. */
const URL_AFTER_MS = 250;

/** What changes the question, and not only how its answer is drawn. */
const question = ({ quantity: _, layers: __, ...rest }: Settings): string => JSON.stringify(rest);

function start(): void {
  const settings = new Store<Settings>(fromHash(location.hash));
  const session = new Store<Session>(NOTHING_YET);
  let afterFrame = (): void => undefined;
  const stage = new Stage(byId("view") as HTMLCanvasElement, () => afterFrame());
  const live = new Live(settings, session);
  const compare = new Compare(settings, session, live);
  const page: Page = { settings, session, live, compare, stage, complaints: new Complaints() };

  const paint = new Paint(page);
  afterFrame = readout(page);
  pressPanel(page);
  accuracyPanel(page);
  colourPanel(page);
  tissuePanel(page);
  effectsPanel(page);
  keyboard(page, keepPanel(page, paint));
  pointer(page);
  inspect(page, paint);

  const dark = matchMedia("(prefers-color-scheme: dark)");
  const ink = (): void => stage.setInk(new Color(dark.matches ? 0xe8eef2 : 0x17242c));
  dark.addEventListener("change", ink);
  ink();

  let timer: ReturnType<typeof setTimeout> | undefined;
  settings.follow((now, before) => {
    if (question(now) !== question(before)) live.refresh();
    clearTimeout(timer);
    timer = setTimeout(() => history.replaceState(null, "", `#${toHash(now)}`), URL_AFTER_MS);
  });
  addEventListener("hashchange", () => settings.set(fromHash(location.hash)));
  live.start();
}

start();
