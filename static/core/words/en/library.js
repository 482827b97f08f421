// English: the images that were worked on.
export default /** @type {const} */ ({
  "library.calibrate-camera.how": "Take an image and calibrate from it, or continue with an earlier one. Clear people from the field first, or capture the background only.",
  "library.earlier-pictures": "Recent images",
  "library.go-on-with": "Continue with the image from",
  "library.images": "Images",
  "library.newest-first": "Images, newest first",
  "library.no-image": "No image yet",
  "library.show-older": "Show older images",
});
