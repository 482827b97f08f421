// Actions on pictures of straight edges: add them, judge them, show them straightened.
import { filePicker } from "../../core/actions.js";
import { go } from "../../core/route.js";
import { t } from "../../core/words.js";
import {
  atStraight,
  isResultCurrent,
  judgeEdges,
  ready,
  search,
  showStraight,
  shownPicture,
} from "./straight.js";

/** @type {import("../../core/actions.js").Action[]} */
export const STRAIGHT_ACTIONS = [
  {
    id: "straight",
    label: t("straight.action.straight"),
    group: "pictures",
    run: () => go("edges"),
  },
  {
    id: "add-edges",
    label: t("straight.action.add-edges"),
    short: t("straight.add-pictures"),
    group: "pictures",
    run: () => filePicker.open(),
    enabled: () => atStraight.value,
  },
  {
    id: "judge-edges",
    label: t("straight.action.judge-edges"),
    short: t("straight.judge-edges"),
    group: "pictures",
    run: () => void judgeEdges(),
    enabled: () => atStraight.value && ready.value.length > 0 && search.value === null,
  },
  {
    id: "stop-judging",
    label: t("straight.action.stop-judging"),
    short: t("common.stop"),
    group: "pictures",
    run: () => search.value?.stop.abort(),
    enabled: () => search.value !== null,
  },
  {
    id: "straighten",
    label: t("straight.action.straighten"),
    group: "pictures",
    run: () => showStraight(!shownPicture.value.straight),
    enabled: () => isResultCurrent.value,
  },
];
