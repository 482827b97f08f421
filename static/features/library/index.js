// Images that were worked on.
import { t } from "../../core/words.js";
import { PictureAdvice } from "../calibrate/panels/picture.js";
import { CameraImagesPage, ImagesPage } from "./panels/images.js";
import { cameraNextStep } from "../live/camera_page.js";

/** @type {import("../../core/features.js").Feature<"camera-images" | "images">} */
export const library = {
  views: {
    "camera-images": {
      addresses: ["cameras/:camera/calibrate"],
      label: t("shell.view.camera-images"),
      Main: CameraImagesPage,
      Report: PictureAdvice,
      tabs: { cameras: 2 },
      nextStep: cameraNextStep,
    },
    images: {
      addresses: ["library/images"],
      label: t("shell.view.images"),
      Main: ImagesPage,
      tabs: { library: 1 },
    },
  },
};
