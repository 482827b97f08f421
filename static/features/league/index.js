// What is sent to other programs on the network.
import { t } from "../../core/words.js";
import { PublishingPage } from "./panels/network.js";

/** @type {import("../../core/features.js").Feature<"publishing">} */
export const network = {
  views: {
    publishing: {
      addresses: ["system/publishing"],
      label: t("shell.view.publishing"),
      Main: PublishingPage,
      tabs: { system: 1 },
    },
  },
};
