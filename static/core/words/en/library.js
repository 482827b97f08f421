// English: the images that were worked on.
export default /** @type {const} */ ({
  "library.calibrate-camera.how": "Take an image and calibrate from it, or go on with one that was begun. Empty the field of people, or take the image without what moves.",
  "library.earlier-pictures": "Earlier pictures",
  "library.go-on-with": "Go on with the image of",
  "library.images": "Images",
  "library.newest-first": "Images, newest first",
  "library.no-image": "No image yet",
  "library.show-older": "Show older images",
});
