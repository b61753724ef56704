/** What every part of the page is given. */

import type { Compare } from "./compare";
import type { Live } from "./live";
import type { Session } from "./model/session";
import type { Settings } from "./model/settings";
import type { Store } from "./model/store";
import type { Complaints } from "./panels/complaints";
import type { Stage } from "./scene/stage";

export interface Page {
  settings: Store<Settings>;
  session: Store<Session>;
  live: Live;
  compare: Compare;
  stage: Stage;
  complaints: Complaints;
}
