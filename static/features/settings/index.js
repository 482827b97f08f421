// The server's settings.
import { t } from "../../core/words.js";
import { SettingsPage } from "./panels/settings.js";

/** @type {import("../../core/features.js").Feature<"server">} */
export const settings = {
  views: {
    server: {
      addresses: ["system/server"],
      label: t("shell.view.server"),
      Main: SettingsPage,
      tabs: { system: 3 },
    },
  },
};
