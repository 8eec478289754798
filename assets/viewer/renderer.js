// Draws scenes: projects every Gaussian once, then blends from back to front.
import { BLEND, COVER, PROJECT, QUAD, QUADS, ROW_BITS, SHOW } from "./shaders.js";

const ROW = 1 << ROW_BITS;

// The linearized projection is kept inside the image and this share of its half width.
const FRUSTUM_MARGIN = 0.3;

/** What is drawn of a Gaussian. */
export const DRAWN = { splats: 0, centers: 1, ellipsoids: 2 };

export class Renderer {
  constructor(canvas) {
    const options = { alpha: false, antialias: false, depth: false, stencil: false, powerPreference: "high-performance" };
    const gl = canvas.getContext("webgl2", options);
    if (!gl) throw new Error("this browser has no WebGL 2");
    this.canvas = canvas;
    this.gl = gl;
    // Blending many faint layers needs more than 8 bits.
    this.deep = Boolean(gl.getExtension("EXT_color_buffer_float") || gl.getExtension("EXT_color_buffer_half_float"));
    gl.getExtension("OES_texture_float_linear");
    this.project = program(gl, COVER, PROJECT);
    this.blend = program(gl, QUAD, BLEND);
    this.show = program(gl, COVER, SHOW);
    this.empty = gl.createVertexArray();
    this.quads = quads(gl);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.pixelStorei(gl.PACK_ALIGNMENT, 1);
  }

  /** Brings an unpacked scene to the device. */
  upload(scene) {
    const { gl } = this;
    const rows = Math.max(1, Math.ceil(scene.count / ROW));
    const colorRows = Math.max(1, Math.ceil((scene.count * scene.coefficients) / ROW));
    const most = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    if (colorRows > most || rows > most) {
      throw new Error(`${scene.count} Gaussians of degree ${scene.degree} are more than this device's textures hold`);
    }
    const colors = scene.channels === 1 ? [gl.R16F, gl.RED, 1] : [gl.RGB16F, gl.RGB, 3];
    const uploaded = {
      ...scene,
      rows,
      meansTexture: filled(gl, gl.RGB32F, gl.RGB, gl.FLOAT, scene.means, 3, rows),
      shapesTexture: filled(gl, gl.RGBA32UI, gl.RGBA_INTEGER, gl.UNSIGNED_INT, scene.shapes, 4, rows),
      colorsTexture: filled(gl, colors[0], colors[1], gl.HALF_FLOAT, scene.colors, colors[2], colorRows),
      footprints: texture(gl, gl.RGBA32UI, ROW, rows),
      shown: texture(gl, gl.RGBA32UI, ROW, rows),
      order: texture(gl, gl.R32UI, ROW, rows),
      ordered: 0,
    };
    uploaded.target = framebuffer(gl, [uploaded.footprints, uploaded.shown]);
    return uploaded;
  }

  /** Gives the Gaussians of a scene other colors. */
  recolor(scene, colors) {
    const { gl } = this;
    gl.bindTexture(gl.TEXTURE_2D, scene.colorsTexture);
    fill(gl, scene.channels === 1 ? gl.RED : gl.RGB, gl.HALF_FLOAT, colors, scene.channels);
  }

  release(scene) {
    const { gl } = this;
    const { meansTexture, shapesTexture, colorsTexture, footprints, shown, order } = scene;
    for (const held of [meansTexture, shapesTexture, colorsTexture, footprints, shown, order]) gl.deleteTexture(held);
    gl.deleteFramebuffer(scene.target);
  }

  /** Sets the order in which the Gaussians of a scene are drawn. */
  order(scene, order) {
    const { gl } = this;
    gl.bindTexture(gl.TEXTURE_2D, scene.order);
    fill(gl, gl.RED_INTEGER, gl.UNSIGNED_INT, order, 1);
    scene.ordered = order.length;
  }

  /**
   * Draws parts side by side on the canvas as `view` sees them. A part is a scene and what
   * share of the width it fills, from and to. `scale` below 1 draws coarser.
   */
  draw(view, parts, { drawn = DRAWN.splats, scale = 1 } = {}) {
    const { gl, canvas } = this;
    const small = scale < 1 ? scaled(view, scale) : view;
    const whole = this.deep || small !== view;
    const target = whole ? this.target(small.width, small.height) : null;
    this.blendInto(target, small, parts, drawn);
    if (!whole) return;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.useProgram(this.show.program);
    bind(gl, 0, this.shownTarget.texture, this.show.uniforms.picture);
    gl.uniform2f(this.show.uniforms.scale, 1 / canvas.width, 1 / canvas.height);
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** Waits until all is drawn. */
  wait() {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  }

  /** The picture of a scene at the view's size, RGBA rows from the top. */
  read(view, scene) {
    const { gl } = this;
    const { texture: color, framebuffer: target } = this.makeTarget(view.width, view.height);
    this.blendInto(target, view, [{ scene, from: 0, to: 1 }], DRAWN.splats);
    const bytes = gl.createRenderbuffer();
    const shown = gl.createFramebuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, bytes);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.RGBA8, view.width, view.height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, shown);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, bytes);
    gl.viewport(0, 0, view.width, view.height);
    gl.useProgram(this.show.program);
    bind(gl, 0, color, this.show.uniforms.picture);
    gl.uniform2f(this.show.uniforms.scale, 1 / view.width, 1 / view.height);
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    const flipped = new Uint8Array(4 * view.width * view.height);
    gl.readPixels(0, 0, view.width, view.height, gl.RGBA, gl.UNSIGNED_BYTE, flipped);
    gl.deleteTexture(color);
    gl.deleteFramebuffer(target);
    gl.deleteFramebuffer(shown);
    gl.deleteRenderbuffer(bytes);
    const pixels = new Uint8ClampedArray(flipped.length);
    const row = 4 * view.width;
    for (let y = 0; y < view.height; y++) {
      pixels.set(flipped.subarray((view.height - 1 - y) * row, (view.height - y) * row), y * row);
    }
    return pixels;
  }

  blendInto(target, view, parts, drawn) {
    const { gl } = this;
    for (const { scene } of parts) this.projectScene(view, scene);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.viewport(0, 0, view.width, view.height);
    gl.clearColor(0, 0, 0, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.enable(gl.SCISSOR_TEST);
    const { program: blend, uniforms } = this.blend;
    gl.useProgram(blend);
    gl.uniform2f(uniforms.size, view.width, view.height);
    gl.uniform1i(uniforms.drawn, drawn);
    for (const { scene, from, to } of parts) {
      const [left, right] = [Math.round(from * view.width), Math.round(to * view.width)];
      gl.scissor(left, 0, Math.max(0, right - left), view.height);
      bind(gl, 0, scene.footprints, uniforms.footprints);
      bind(gl, 1, scene.shown, uniforms.shown);
      bind(gl, 2, scene.order, uniforms.order);
      gl.uniform1i(uniforms.ordered, scene.ordered);
      gl.bindVertexArray(this.quads);
      gl.drawElementsInstanced(gl.TRIANGLES, 6 * QUADS, gl.UNSIGNED_SHORT, 0, Math.ceil(scene.ordered / QUADS));
    }
    gl.disable(gl.SCISSOR_TEST);
    gl.disable(gl.BLEND);
  }

  projectScene(view, scene) {
    const { gl } = this;
    const { program: project, uniforms } = this.project;
    gl.bindFramebuffer(gl.FRAMEBUFFER, scene.target);
    gl.viewport(0, 0, ROW, scene.rows);
    gl.useProgram(project);
    bind(gl, 0, scene.meansTexture, uniforms.means);
    bind(gl, 1, scene.shapesTexture, uniforms.shapes);
    bind(gl, 2, scene.colorsTexture, uniforms.colors);
    gl.uniform1i(uniforms.count, scene.count);
    gl.uniform1i(uniforms.degree, scene.degree);
    gl.uniform1i(uniforms.gray, scene.channels === 1 ? 1 : 0);
    gl.uniform1i(uniforms.antialiased, scene.antialiased ? 1 : 0);
    gl.uniform2fv(uniforms.log_scale, scene.logScale);
    gl.uniformMatrix3fv(uniforms.world_to_camera, true, view.rotation);
    gl.uniform3fv(uniforms.translation, view.translation);
    gl.uniform3fv(uniforms.eye, view.eye);
    gl.uniform4f(uniforms.intrinsics, view.fx, view.fy, view.cx, view.cy);
    gl.uniform4fv(uniforms.slope_limits, slopeLimits(view));
    gl.uniform2f(uniforms.size, view.width, view.height);
    gl.uniform1f(uniforms.near, view.near);
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** The target of the canvas's size, made anew where it has another. */
  target(width, height) {
    const kept = this.shownTarget;
    if (!kept || kept.width !== width || kept.height !== height) {
      if (kept) {
        this.gl.deleteTexture(kept.texture);
        this.gl.deleteFramebuffer(kept.framebuffer);
      }
      this.shownTarget = this.makeTarget(width, height);
    }
    return this.shownTarget.framebuffer;
  }

  makeTarget(width, height) {
    const { gl } = this;
    const color = texture(gl, this.deep ? gl.RGBA16F : gl.RGBA8, width, height, gl.LINEAR);
    return { texture: color, framebuffer: framebuffer(gl, [color]), width, height };
  }
}

/** The same view with a picture of another size. */
export function scaled(view, scale) {
  const width = Math.max(1, Math.round(view.width * scale));
  const height = Math.max(1, Math.round(view.height * scale));
  const [x, y] = [width / view.width, height / view.height];
  return { ...view, width, height, fx: view.fx * x, fy: view.fy * y, cx: view.cx * x, cy: view.cy * y };
}

function slopeLimits({ width, height, fx, fy, cx, cy }) {
  const x = (FRUSTUM_MARGIN * 0.5 * width) / fx;
  const y = (FRUSTUM_MARGIN * 0.5 * height) / fy;
  return [-cx / fx - x, -cy / fy - y, (width - cx) / fx + x, (height - cy) / fy + y];
}

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  const uniforms = {};
  for (let k = 0; k < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); k++) {
    const { name } = gl.getActiveUniform(made, k);
    uniforms[name] = gl.getUniformLocation(made, name);
  }
  return { program: made, uniforms };
}

function bind(gl, unit, held, uniform) {
  gl.activeTexture(gl.TEXTURE0 + unit);
  gl.bindTexture(gl.TEXTURE_2D, held);
  gl.uniform1i(uniform, unit);
}

function texture(gl, format, width, height, filter = gl.NEAREST) {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
  for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
  for (const which of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, which, filter);
  return made;
}

/** A texture with `values`, `channels` a texel, whose last row may be short. */
function filled(gl, internal, format, type, values, channels, rows) {
  const made = texture(gl, internal, ROW, rows);
  fill(gl, format, type, values, channels);
  return made;
}

function fill(gl, format, type, values, channels) {
  const texels = values.length / channels;
  const whole = Math.floor(texels / ROW);
  if (whole > 0) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, ROW, whole, format, type, values, 0);
  const rest = texels - whole * ROW;
  if (rest > 0) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, whole, rest, 1, format, type, values, whole * ROW * channels);
}

/** The corners of an instance's quads, two triangles each. */
function quads(gl) {
  const corners = Uint16Array.from({ length: 6 * QUADS }, (_, k) => 4 * Math.floor(k / 6) + [0, 1, 2, 2, 1, 3][k % 6]);
  const made = gl.createVertexArray();
  gl.bindVertexArray(made);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, corners, gl.STATIC_DRAW);
  gl.bindVertexArray(null);
  return made;
}

function framebuffer(gl, textures) {
  const made = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, made);
  const attachments = textures.map((color, k) => {
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + k, gl.TEXTURE_2D, color, 0);
    return gl.COLOR_ATTACHMENT0 + k;
  });
  gl.drawBuffers(attachments);
  return made;
}
