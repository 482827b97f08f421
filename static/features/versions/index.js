// Saved versions: saving, activating, the list, and import.
import { t } from "../../core/words.js";
import { VERSION_ACTIONS } from "./actions.js";
import { ImportPage } from "./panels/imports.js";
import { VersionListPage, VersionListReport } from "./panels/version_list.js";

/** @type {import("../../core/features.js").Feature<"versions" | "import">} */
export const versions = {
  actions: VERSION_ACTIONS,
  views: {
    versions: {
      addresses: ["cameras/:camera/versions", "library/versions"],
      label: t("shell.view.versions"),
      Main: VersionListPage,
      Report: VersionListReport,
      tabs: { cameras: 5, library: 2 },
    },
    import: {
      addresses: ["library/import"],
      label: t("shell.view.import"),
      Main: ImportPage,
      tabs: { library: 4 },
    },
  },
};
