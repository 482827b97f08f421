// Snaps clicked points to the middle of the painted line beside them: the server finds it, the page shows how far each
// moved.
import { computed, effect, signal, untracked } from "@preact/signals";
import { ServerUnreachable, call } from "../../core/api.js";
import { change, doc, dragging, future, pointsOf, withPoints } from "../../core/document.js";
import { number } from "../../core/format.js";
import { preference } from "../../core/preference.js";
import { latestWins } from "../../core/latest_wins.js";
import { active, editing, kindOf, notifyError, pointer, snapshot, tool } from "../../core/state.js";
import { t } from "../../core/words.js";
import { view } from "../../canvas/viewport.js";
import { givenFit } from "./fitting.js";

/**
 * @typedef {import("../../core/types").Pick} Pick
 * @typedef {import("../../core/types").Point} Point
 * @typedef {import("../../core/types").SnapAnswer} SnapAnswer
 */

const REACH_PX = 12,
  REACH_TOUCH_PX = 22; // on the stage: hands err on the screen, not in the picture
const MIN_PX = 3,
  MAX_PX = 24; // of the picture
const PAUSE_MS = 30; // between two looks ahead
const STILL_PX = 0.005;

export const snapping = preference("touchline.snap");
const said = signal({ text: "", of: doc.value });
/** What became of the last points, in words: nothing is moved in silence. An undo takes it back with the points. */
export const snapMessage = computed(() => (said.value.of === doc.value ? said.value.text : ""));
/** @param {string} text of the document as it is now */
export const saySnapped = (text) => {
  said.value = { text, of: doc.value };
};
/** Where the point under the pointer would go. */
export const snapPreview = signal(/** @type {(SnapAnswer & { of: Point }) | null} */ (null));
/** Whether the key is held with which points are placed freely. */
export const isSnapSuspended = signal(false);

export function toggleSnapping() {
  snapping.value = !snapping.value;
  saySnapped(snapping.value ? t("calibrate.snapping.on") : t("calibrate.snapping.off"));
}

/** How far a line may be from a click, px of the picture. @param {boolean} [touch] */
const reach = (touch = false) =>
  Math.min(Math.max((touch ? REACH_TOUCH_PX : REACH_PX) / view.value.k, MIN_PX), MAX_PX);

/** @param {string} feature @param {Point[]} points @param {boolean} [touch] @returns {Promise<SnapAnswer[]>} */
async function ask(feature, points, touch) {
  const fit = givenFit();
  const body = { points, reach_px: reach(touch), ...(fit ? { fit, feature } : {}) };
  return (await call("POST", `/snapshots/${snapshot.value?.id}/snap`, body)).points;
}

/**
 * Draw points to their lines, as one change: undo brings them back to where they were put.
 * @param {Pick[]} picks
 * @param {boolean} [touch]
 */
export async function snapPoints(picks, touch) {
  const picture = snapshot.value?.id,
    placed = [...new Set(picks.map((p) => p.feature))]
      .filter((f) => kindOf(f) === "line")
      .map((feature) => {
        const own = pointsOf(doc.value, feature),
          indices = picks
            .filter((p) => p.feature === feature && p.index < own.length)
            .map((p) => p.index);
        return { feature, indices, points: indices.map((i) => own[i]) };
      });
  if (!picture || !placed.some((one) => one.points.length)) return;
  saySnapped(""); // of the points before these
  try {
    const answers = await Promise.all(
      placed.map(({ feature, points }) => ask(feature, points, touch)),
    );
    await letGo(); // a quick hand presses for the next point already
    // Somebody who has gone on, gone back or moved a point means it so.
    if (snapshot.value?.id !== picture || future.value.length) return;
    settle(placed, answers);
  } catch (error) {
    if (!(error instanceof ServerUnreachable)) notifyError(error);
  }
}

/** Once no point is held. @returns {Promise<void>} */
const letGo = () =>
  new Promise((done) => {
    const end = effect(() => {
      if (!dragging.value)
        queueMicrotask(() => {
          end();
          done();
        });
    });
  });

/** @param {{ feature: string, indices: number[], points: Point[] }[]} placed @param {SnapAnswer[][]} answers */
function settle(placed, answers) {
  let next = doc.value,
    count = 0,
    farthest = 0,
    why = "";
  placed.forEach(({ feature, indices, points }, at) => {
    const own = [...pointsOf(next, feature)];
    indices.forEach((index, i) => {
      const answer = answers[at][i],
        stands = own[index] && own[index][0] === points[i][0] && own[index][1] === points[i][1];
      if (answer.state !== "snapped") why ||= answer.what ?? "";
      if (!stands || answer.state !== "snapped") return;
      own[index] = [
        Math.round(answer.point[0] * 100) / 100,
        Math.round(answer.point[1] * 100) / 100,
      ];
      count += 1;
      farthest = Math.max(farthest, answer.moved_px ?? 0);
    });
    if (own.length) next = withPoints(next, feature, own, kindOf(feature));
  });
  const asked = placed.reduce((sum, one) => sum + one.points.length, 0);
  if (farthest > STILL_PX) change(next);
  saySnapped(
    asked === 1
      ? count
        ? t("calibrate.snapping.snapped", { distance: number(farthest, 1) })
        : t("calibrate.snapping.not-snapped", { why })
      : t("calibrate.snapping.snapped-several", {
          snapped: count,
          asked,
          farthest: number(farthest, 1),
        }),
  );
}

/** Look ahead from the pointer, from now on; the newest question wins. */
export function startSnapping() {
  const look = latestWins(
    async (
      /** @type {{ at: Point, feature: string, touch: boolean }} */ { at, feature, touch },
    ) => {
      const [answer] = await ask(feature, [at], touch).catch(() => []);
      snapPreview.value = answer ? { ...answer, of: at } : null;
      await new Promise((done) => setTimeout(done, PAUSE_MS));
    },
  );
  effect(() => {
    const at = pointer.value,
      feature = active.value;
    const wanted =
      at &&
      (!at.touch || at.down) &&
      snapping.value &&
      !isSnapSuspended.value &&
      editing.value &&
      tool.value === "pick" &&
      kindOf(feature) === "line";
    untracked(() => {
      if (wanted) void look({ at: [at.x, at.y], feature, touch: at.touch });
      else snapPreview.value = null;
    });
  });
  const alt = (/** @type {KeyboardEvent} */ e) => {
    if (e.key === "Alt") isSnapSuspended.value = e.type === "keydown";
  };
  for (const type of /** @type {const} */ (["keydown", "keyup"])) addEventListener(type, alt);
  addEventListener("blur", () => {
    isSnapSuspended.value = false;
  });
}
