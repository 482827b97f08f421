// Fields: their list, and the editor.
import { t } from "../../core/words.js";
import { FIELD_EDITOR_ACTIONS } from "./actions.js";
import { editorNextStep, startFieldEditor } from "./editor.js";
import { EditorPage } from "./panels/editor_page.js";
import { FieldForm } from "./panels/field_form.js";
import { FieldsPage } from "./panels/fields_page.js";
import { Markings } from "./panels/markings.js";

const EDITOR = {
  Form: FieldForm,
  Main: EditorPage,
  Report: Markings,
  nextStep: editorNextStep,
  behind: "fields",
};

/** @type {import("../../core/features.js").Feature<"fields" | "new-field" | "field-editor">} */
export const fields = {
  actions: FIELD_EDITOR_ACTIONS,
  start: [startFieldEditor],
  views: {
    fields: {
      addresses: ["library/fields"],
      label: t("shell.view.fields"),
      Main: FieldsPage,
      tabs: { library: 3 },
    },
    "new-field": {
      addresses: ["library/new-field/:field", "library/new-field"],
      label: t("shell.view.new-field"),
      ...EDITOR,
    },
    "field-editor": {
      addresses: ["library/fields/:field"],
      label: t("shell.view.field-editor"),
      ...EDITOR,
    },
  },
  jobs: { "field-refit": t("jobs.kind.field-refit") },
};
