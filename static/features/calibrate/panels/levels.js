// The levels of a verdict in words.
import { t } from "../../../core/words.js";

export const LEVEL = {
  good: t("common.level.good"),
  fair: t("common.level.fair"),
  poor: t("common.level.poor"),
  unknown: t("calibrate.levels.unknown"),
};
