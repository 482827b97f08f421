// What the server computes.
import { t } from "../../core/words.js";
import { startJobs } from "./job_list.js";
import { JobsPage } from "./panels/jobs.js";

/** @type {import("../../core/features.js").Feature<"jobs">} */
export const jobs = {
  start: [startJobs],
  views: {
    jobs: {
      addresses: ["system/jobs"],
      label: t("shell.view.jobs"),
      Main: JobsPage,
      tabs: { system: 2 },
    },
  },
};
