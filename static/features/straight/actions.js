// Actions on pictures of straight edges: add them, judge them, show them straightened.
import { filePicker } from "../../core/actions.js";
import { go } from "../../core/route.js";
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
    label: "Check a lens by straight edges…",
    group: "Pictures",
    run: () => go("edges"),
  },
  {
    id: "add-edges",
    label: "Add pictures of straight edges…",
    short: "Add pictures…",
    group: "Pictures",
    run: () => filePicker.open(),
    enabled: () => atStraight.value,
  },
  {
    id: "judge-edges",
    label: "Judge how straight the edges are",
    short: "Judge the edges",
    group: "Pictures",
    run: () => void judgeEdges(),
    enabled: () => atStraight.value && ready.value.length > 0 && search.value === null,
  },
  {
    id: "stop-judging",
    label: "Stop judging the edges",
    short: "Stop",
    group: "Pictures",
    run: () => search.value?.stop.abort(),
    enabled: () => search.value !== null,
  },
  {
    id: "straighten",
    label: "Show the picture straightened, or as taken",
    group: "Pictures",
    run: () => showStraight(!shownPicture.value.straight),
    enabled: () => isResultCurrent.value,
  },
];
