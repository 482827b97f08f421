// English: the list of pictures that a lens is found or judged by, and what the ways to find a lens say alike.
export default /** @type {const} */ ({
  "lens-pictures.being-uploaded": "The pictures are being uploaded.",
  "lens-pictures.how-to-add": "many at once; or drop them here. PNG, JPEG, BMP or WebP.",
  "lens-pictures.lens": "Lens",
  "lens-pictures.list": "Pictures of {subject}",
  "lens-pictures.list-count": { one: "{count} picture of {subject}", other: "{count} pictures of {subject}" },
  "lens-pictures.picture-name": "Picture {number}",
  "lens-pictures.remove": "Remove {name}",
  "lens-pictures.remove-all": "Remove all pictures",
  "lens-pictures.remove-picture": "Remove this picture",
  "lens-pictures.state.uploaded": "Uploaded",
  "lens-pictures.state.uploading": "Uploading…",
  "lens-pictures.state.waiting": "Waiting…",
  "lens-pictures.take-one": "Take one with {camera}",
  "lens-pictures.waiting-for-camera": "Waiting for the camera…",
});
