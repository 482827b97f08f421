// Lenses from a board: of pictures, of a camera, and the list of lenses.
import { t } from "../../core/words.js";
import { BOARD_ACTIONS } from "./actions.js";
import { addPictures, boardNextStep, startBoard } from "./board.js";
import { captureNextStep, startCapture } from "./capture.js";
import { startLenses } from "./lenses.js";
import { BoardForm, BoardPage } from "./panels/board.js";
import { CaptureForm, CapturePage, CaptureReport } from "./panels/capture.js";
import { LensReport } from "./panels/lens_report.js";
import { LensesPage } from "./panels/lenses_page.js";

/** @type {import("../../core/features.js").Feature<"lenses" | "board" | "capture">} */
export const board = {
  actions: BOARD_ACTIONS,
  start: [startBoard, startCapture, startLenses],
  views: {
    lenses: {
      addresses: ["lenses"],
      label: t("shell.place.lenses"),
      Main: LensesPage,
      tabs: { lenses: 1 },
      tab: t("shell.tab.lenses"),
    },
    board: {
      addresses: ["lenses/board"],
      label: t("shell.view.board"),
      Form: BoardForm,
      Main: BoardPage,
      Report: LensReport,
      add: addPictures,
      tabs: { lenses: 2 },
      nextStep: boardNextStep,
    },
    capture: {
      addresses: ["lenses/board/:camera"],
      label: t("shell.view.capture"),
      Form: CaptureForm,
      Main: CapturePage,
      Report: CaptureReport,
      behind: "board",
      nextStep: captureNextStep,
    },
  },
  jobs: { board: t("jobs.kind.board") },
};
