// Corrects a picture on a graphics processor: every pixel of a canvas is looked up in the raw picture, at the place
// that a coarse mesh says. The same in a page and in a worker.

/**
 * @typedef {object} Mesh where the nodes of an even grid over the corrected view lie in the raw picture
 * @property {number} columns @property {number} rows @property {[number, number]} step corrected pixels between nodes
 * @property {Float32Array} nodes raw x and y of each, row by row; NaN out of reach
 */

const VERTICES = `#version 300 es
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0);
}`;

// What lies beside the raw picture has one colour, into which its outermost pixels pass within a pixel: as where the
// server corrects it (OpenCV's remap with a constant border).
const FRAGMENTS = `#version 300 es
precision highp float;
precision highp sampler2D;
uniform sampler2D picture, mesh;
uniform vec2 pictureSize, cells, cellSize, corner;
uniform float canvasHeight, scale, detail;
uniform bool isNearest;
uniform vec3 beside;
out vec4 colour;
void main() {
  vec2 at = (vec2(gl_FragCoord.x, canvasHeight - gl_FragCoord.y) - corner) / scale / cellSize;
  if (any(lessThan(at, vec2(0.0))) || any(greaterThan(at, cells))) { colour = vec4(0.0); return; }
  ivec2 cell = ivec2(min(floor(at), cells - 1.0));
  vec2 part = at - vec2(cell);
  vec2 upper = mix(texelFetch(mesh, cell, 0).xy, texelFetch(mesh, cell + ivec2(1, 0), 0).xy, part.x);
  vec2 lower = mix(texelFetch(mesh, cell + ivec2(0, 1), 0).xy, texelFetch(mesh, cell + ivec2(1, 1), 0).xy, part.x);
  vec2 raw = mix(upper, lower, part.y);
  vec2 covered = clamp(raw + 1.0, 0.0, 1.0) * clamp(pictureSize - raw, 0.0, 1.0);
  vec3 seen = isNearest
    ? texelFetch(picture, ivec2(clamp(floor(raw + 0.5), vec2(0.0), pictureSize - 1.0)), 0).rgb
    : textureLod(picture, (raw + 0.5) / pictureSize, detail).rgb;
  colour = vec4(mix(beside, seen, covered.x * covered.y), 1.0);
}`;
const UNIFORMS = [
  "picture",
  "mesh",
  "pictureSize",
  "cells",
  "cellSize",
  "corner",
  "canvasHeight",
  "scale",
  "detail",
  "isNearest",
  "beside",
];
const BESIDE = [16 / 255, 20 / 255, 24 / 255]; // the server's colour of what no pixel shows
const FAR = -1e9; // raw pixels of a node out of reach: so is all that is interpolated with it
const PICTURE = 0, // texture units
  MESH = 1;

/**
 * Begin to correct on a canvas; null where it has no WebGL 2.
 * @param {HTMLCanvasElement | OffscreenCanvas} canvas
 */
export function createWarp(canvas) {
  const gl = /** @type {WebGL2RenderingContext | null} */ (
    canvas.getContext("webgl2", { antialias: false, depth: false })
  );
  if (!gl) return null;
  const program = linked(gl);
  if (!program) return null;
  gl.useProgram(program);
  const at = Object.fromEntries(
    UNIFORMS.map((name) => [name, gl.getUniformLocation(program, name)]),
  );
  gl.uniform1i(at.picture, PICTURE);
  gl.uniform1i(at.mesh, MESH);
  gl.uniform3f(at.beside, BESIDE[0], BESIDE[1], BESIDE[2]);
  texture(gl, PICTURE, gl.LINEAR_MIPMAP_NEAREST, gl.LINEAR);
  texture(gl, MESH, gl.NEAREST, gl.NEAREST);
  gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
  const largest = gl.getParameter(gl.MAX_TEXTURE_SIZE);
  gl.clearColor(0, 0, 0, 0);
  let hasPicture = false,
    /** Corrected pixels of the whole view; null without a mesh. */
    view = /** @type {{ width: number, height: number } | null} */ (null);

  return {
    /** Whether a picture of this size can be corrected. @param {number} width @param {number} height */
    canHold: (width, height) => Math.max(width, height) <= largest,

    /**
     * Take a raw picture. isStill: it will be drawn at many zooms, so smaller versions of it are made, too.
     * @param {HTMLImageElement | ImageBitmap} picture @param {number} width @param {number} height @param {boolean}
     * isStill
     */
    setPicture(picture, width, height, isStill) {
      gl.activeTexture(gl.TEXTURE0 + PICTURE);
      gl.texParameteri(
        gl.TEXTURE_2D,
        gl.TEXTURE_MIN_FILTER,
        isStill ? gl.LINEAR_MIPMAP_NEAREST : gl.LINEAR,
      );
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, picture);
      if (isStill) gl.generateMipmap(gl.TEXTURE_2D);
      gl.uniform2f(at.pictureSize, width, height);
      hasPicture = true;
    },

    /** @param {Mesh} mesh */
    setMesh({ columns, rows, step, nodes }) {
      gl.activeTexture(gl.TEXTURE0 + MESH);
      const places = nodes.map((value) => (Number.isNaN(value) ? FAR : value));
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RG32F, columns, rows, 0, gl.RG, gl.FLOAT, places);
      gl.uniform2f(at.cells, columns - 1, rows - 1);
      gl.uniform2f(at.cellSize, step[0], step[1]);
      view = { width: (columns - 1) * step[0], height: (rows - 1) * step[1] };
    },

    /**
     * Draw the corrected view, its corner at (x, y) of the canvas and so many of its pixels for each corrected one;
     * what lies beside the view stays transparent, and so does what is left of `from`, which nobody sees. isNearest:
     * pixels of the raw picture as the squares they are.
     * @param {{ x: number, y: number, scale: number, from?: number, isNearest?: boolean }} place
     */
    draw({ x, y, scale, from = 0, isNearest = false }) {
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.disable(gl.SCISSOR_TEST);
      gl.clear(gl.COLOR_BUFFER_BIT);
      if (!hasPicture || !view) return;
      const left = Math.floor(Math.max(0, from, x)),
        right = Math.ceil(Math.min(canvas.width, x + view.width * scale)),
        top = Math.floor(Math.max(0, y)),
        bottom = Math.ceil(Math.min(canvas.height, y + view.height * scale));
      if (left >= right || top >= bottom) return;
      gl.enable(gl.SCISSOR_TEST);
      gl.scissor(left, canvas.height - bottom, right - left, bottom - top);
      gl.uniform2f(at.corner, x, y);
      gl.uniform1f(at.scale, scale);
      gl.uniform1f(at.canvasHeight, canvas.height);
      gl.uniform1f(at.detail, Math.max(0, Math.round(-Math.log2(scale))));
      gl.uniform1i(at.isNearest, Number(isNearest));
      gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    },

    /** Wait until what was drawn is there, as the next frame does. */
    finish() {
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    },

    /** Give its memory back at once, not when the page is next tidied up. */
    end() {
      gl.getExtension("WEBGL_lose_context")?.loseContext();
    },
  };
}

/** @param {WebGL2RenderingContext} gl */
function linked(gl) {
  const program = gl.createProgram();
  for (const [type, source] of /** @type {[number, string][]} */ ([
    [gl.VERTEX_SHADER, VERTICES],
    [gl.FRAGMENT_SHADER, FRAGMENTS],
  ])) {
    const shader = gl.createShader(type);
    if (!shader) return null; // the context is lost
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  return gl.getProgramParameter(program, gl.LINK_STATUS) ? program : null;
}

/** @param {WebGL2RenderingContext} gl @param {number} unit @param {number} smaller @param {number} larger */
function texture(gl, unit, smaller, larger) {
  gl.activeTexture(gl.TEXTURE0 + unit);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  for (const [name, value] of [
    [gl.TEXTURE_MIN_FILTER, smaller],
    [gl.TEXTURE_MAG_FILTER, larger],
    [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE],
    [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE],
  ])
    gl.texParameteri(gl.TEXTURE_2D, name, value);
}
