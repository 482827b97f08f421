// English: the list of pictures that a lens is found or judged by, and what the ways to find a lens say alike.
export default /** @type {const} */ ({
  "lens-pictures.being-uploaded": "The images are being uploaded.",
  "lens-pictures.how-to-add": "Select several at once, or drop them here. PNG, JPEG, BMP or WebP.",
  "lens-pictures.lens": "Lens",
  "lens-pictures.list": "Images of {subject}",
  "lens-pictures.list-count": { one: "{count} image of {subject}", other: "{count} images of {subject}" },
  "lens-pictures.picture-name": "Image {number}",
  "lens-pictures.remove": "Remove {name}",
  "lens-pictures.remove-all": "Remove all images",
  "lens-pictures.remove-picture": "Remove this image",
  "lens-pictures.state.uploaded": "Uploaded",
  "lens-pictures.state.uploading": "Uploading…",
  "lens-pictures.state.waiting": "Waiting…",
  "lens-pictures.take-one": "Capture with {camera}",
  "lens-pictures.waiting-for-camera": "Waiting for the camera…",
});
