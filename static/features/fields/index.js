// Fields: each with its cameras and rigs, and the editor.
import { t } from "../../core/words.js";
import { FIELD_EDITOR_ACTIONS } from "./actions.js";
import { editorNextStep, startFieldEditor } from "./editor.js";
import { EditorPage } from "./panels/editor_page.js";
import { FieldForm } from "./panels/field_form.js";
import { FieldPage } from "./panels/field_page.js";
import { Markings } from "./panels/markings.js";

const EDITOR = {
  Form: FieldForm,
  Main: EditorPage,
  Report: Markings,
  nextStep: editorNextStep,
  behind: "field",
};

/** @type {import("../../core/features.js").Feature<"field" | "new-field" | "field-editor">} */
export const fields = {
  actions: FIELD_EDITOR_ACTIONS,
  start: [startFieldEditor],
  views: {
    field: {
      addresses: ["field"],
      label: t("shell.place.field"),
      Main: FieldPage,
      tabs: { field: 1 },
      tab: t("shell.tab.field"),
    },
    "new-field": {
      addresses: ["field/new-field/:field", "field/new-field"],
      label: t("shell.view.new-field"),
      ...EDITOR,
    },
    "field-editor": {
      addresses: ["field/fields/:field"],
      label: t("shell.view.field-editor"),
      ...EDITOR,
    },
  },
  jobs: { "field-refit": t("jobs.kind.field-refit") },
};
