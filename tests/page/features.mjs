// The page's features as main.js registers them: its views have addresses, and its actions are there.
import "./window.mjs";
import { registerFeatures } from "../../static/core/features.js";
import { FEATURES } from "../../static/features/index.js";

registerFeatures(FEATURES);
